"""The simulated world of papers 1 and 4: doors, the robot among them, and its controllers."""
