"""Inverse kinematics, one method a paper."""
