"""Robots in a scene: MuJoCo models, pinocchio models, and motions that the front end plays by itself."""

from collections.abc import Iterable

import meshcat.animation as ma
import meshcat.commands
import mujoco
import numpy as np
import pinocchio
import umsgpack

from tutorialbot.errors import InvalidType, InvalidValue, finite_array, finite_number, positive, whole_number
from tutorialbot.viewers import shapes
from tutorialbot.viewers.scene import Scene, pose_of

FLOAT32 = 0x17  # meshcat's msgpack extension for a Float32Array
STEP = 1.0 / 30.0  # longest time between two poses that are sent [s]; the front end interpolates between them
TOLERANCE = 2e-4  # a pose is left out when its neighbours' line meets it within this [m, rad/2]


class _View:
    """Nodes of a scene that move as rigid bodies: what both kinds of robot share."""

    def __init__(self, scene: Scene | None, prefix: str, offset, opacity: float):
        if scene is not None and not isinstance(scene, Scene):
            raise InvalidType("scene", scene, "a Scene or None")
        if not isinstance(prefix, str) or not prefix.strip("/"):
            raise InvalidValue("prefix", prefix, "a name such as 'robot'")
        self.scene, self.root = scene or Scene(), prefix.strip("/")
        self._opacity = finite_number("opacity", opacity, 0.0, 1.0)
        self._offset = np.eye(4) if offset is None else pose_of("offset", offset)

    def _load(self, nodes: dict[str, list[shapes.Part]], first: np.ndarray) -> None:
        """Replace what stands under the prefix by `nodes`, placed by the pose `first` (a row of nq numbers)."""
        self._paths, self._shown = list(nodes), None
        with self.scene.window.batch():
            if any(key[1].startswith(f"/meshcat/{self.root}/") for key in self.scene.window.entries):
                self.scene[self.root].delete()
            if self.scene._clips.pop(self.root, None):
                self.scene.set_animation(ma.Animation(_all_clips(self.scene)))
            self.scene[self.root].set_transform(self._offset)
            for path, parts in nodes.items():
                for part in parts:
                    node = self.scene[f"{self.root}/{path}/{part.name}"]
                    node.set_object(part.object)
                    node.set_transform(part.pose)
            self._place(self._poses(first))

    def _place(self, poses: np.ndarray) -> None:
        """Move the nodes to `poses` (nodes, 4, 4); those that stand still send nothing."""
        with self.scene.window.batch():
            for i, path in enumerate(self._paths):
                if self._shown is None or not np.array_equal(poses[i], self._shown[i]):
                    self.scene[f"{self.root}/{path}"].set_transform(poses[i])
        self._shown = poses.copy()

    def _poses(self, q: np.ndarray) -> np.ndarray:
        raise NotImplementedError

    @property
    def widget(self):
        """The scene's ipywidget."""
        return self.scene.widget

    def _repr_mimebundle_(self, **kwargs):
        return self.scene._repr_mimebundle_(**kwargs)

    def __repr__(self) -> str:
        return f"{type(self).__name__}()"


class MujocoView(_View):
    """All geoms of a MuJoCo model in a scene.

    Args:
        model: the compiled model.
        scene: where to draw; a new Scene by default.
        groups: geom groups to draw (by default those that MuJoCo's own viewer shows).
        prefix: name of the robot in the scene; the same name again replaces it, another stands beside it.
        offset: 4x4 matrix or pinocchio.SE3 that moves the whole model in the scene.
        opacity: 1 for solid, less for a ghost.
    """

    def __init__(self, model, scene=None, groups=(0, 1, 2), prefix="robot", offset=None, opacity=1.0):
        if not isinstance(model, mujoco.MjModel):
            raise InvalidType("model", model, "a mujoco.MjModel")
        if not isinstance(groups, Iterable):
            raise InvalidType("groups", groups, "numbers of geom groups, such as (0, 1, 2)")
        super().__init__(scene, prefix, offset, opacity)
        groups = {whole_number("groups", group) for group in groups}
        self.model, self._data, self._bodies = model, mujoco.MjData(model), []
        nodes = {}
        for body in range(model.nbody):
            first, count = model.body_geomadr[body], model.body_geomnum[body]
            geoms = [g for g in range(first, first + count) if model.geom_group[g] in groups]
            parts = [p for p in (shapes.mujoco_part(model, g, self._opacity) for g in geoms) if p is not None]
            if parts:
                name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_BODY, body) or "body"
                nodes[f"{name.replace('/', '_')}_{body}"] = parts
                self._bodies.append(body)
        self._load(nodes, model.qpos0)

    def update(self, data) -> None:
        """Show the model as in `data`: a mujoco.MjData (positions and mocap bodies are read), or qpos (nq,)."""
        if isinstance(data, mujoco.MjData):
            self._data.mocap_pos[:], self._data.mocap_quat[:] = data.mocap_pos, data.mocap_quat
            data = data.qpos
        self._place(self._poses(finite_array("qpos", data, (self.model.nq,))))

    def _poses(self, q: np.ndarray) -> np.ndarray:
        self._data.qpos[:] = q
        mujoco.mj_kinematics(self.model, self._data)
        poses = np.tile(np.eye(4), (len(self._bodies), 1, 1))
        poses[:, :3, :3] = self._data.xmat[self._bodies].reshape(-1, 3, 3)
        poses[:, :3, 3] = self._data.xpos[self._bodies]
        return poses


class PinocchioView(_View):
    """A pinocchio model with its visual (or collision) geometries in a scene.

    Args:
        model: pinocchio.Model; visual_model: its pinocchio.GeometryModel; the rest as for MujocoView.
    """

    def __init__(self, model, visual_model, scene=None, prefix="robot", offset=None, opacity=1.0):
        if not isinstance(model, pinocchio.Model):
            raise InvalidType("model", model, "a pinocchio.Model")
        if not isinstance(visual_model, pinocchio.GeometryModel):
            raise InvalidType("visual_model", visual_model, "a pinocchio.GeometryModel")
        super().__init__(scene, prefix, offset, opacity)
        self.model, self._data = model, model.createData()
        by_joint: dict[int, list[shapes.Part]] = {}
        for geometry in visual_model.geometryObjects:
            by_joint.setdefault(geometry.parentJoint, []).append(shapes.pinocchio_part(geometry, self._opacity))
        self._joints = list(by_joint)
        nodes = {f"{model.names[j].replace('/', '_')}_{j}": parts for j, parts in by_joint.items()}
        self._load(nodes, pinocchio.neutral(model))

    def update(self, q) -> None:
        """Show the model in the configuration `q` (nq,)."""
        self._place(self._poses(finite_array("q", q, (self.model.nq,))))

    def _poses(self, q: np.ndarray) -> np.ndarray:
        pinocchio.forwardKinematics(self.model, self._data, q)
        return np.array([self._data.oMi[j].homogeneous for j in self._joints]).reshape(-1, 4, 4)


class _Track(ma.AnimationTrack):
    """meshcat's animation track with its times [s] and values as packed numbers: a twentieth of the size."""

    def lower(self) -> dict:
        """Return meshcat's dictionary of the track, with three.js's own keys `times` and `values`."""
        packed = {"times": self.frames, "values": self.values}
        numbers = {k: umsgpack.Ext(FLOAT32, np.asarray(v, np.float32).tobytes()) for k, v in packed.items()}
        return {"name": f".{self.name}", "type": self.jstype, **numbers}


class _PlayCommand(meshcat.commands.SetAnimation):
    """meshcat's command with a speed for the player."""

    def __init__(self, animation, repetitions: float, speed: float):
        super().__init__(animation, True, repetitions)
        self.speed = speed

    def lower(self) -> dict:
        """Return meshcat's dictionary with `speed` among the options."""
        lowered = super().lower()
        return {**lowered, "options": {**lowered["options"], "speed": self.speed}}


def play(view: _View, qpos, times, speed: float = 1.0, repeat: bool = True):
    """Give a robot a motion that the front end plays: play and pause, time slider, speed. The HTML page has it too.

    Args:
        view: a MujocoView or PinocchioView. Two views of one scene can each have a motion; they run together.
        qpos: configurations, (n, nq); times: (n,) [s], rising.
        speed: 1 for real time; repeat: start again at the end.

    Returns the scene's widget. Raises InvalidValue for times that do not rise or lengths that differ.
    """
    if not isinstance(view, _View):
        raise InvalidType("view", view, "a MujocoView or a PinocchioView")
    qpos, times = finite_array("qpos", qpos, (-1, view.model.nq)), finite_array("times", times, (-1,))
    if len(qpos) != len(times) or len(times) < 2:
        raise InvalidValue("times", f"{len(times)} times for {len(qpos)} configurations", "as many, two at least")
    if not (np.diff(times) > 0.0).all():
        raise InvalidValue("times", times, "rising numbers")
    times = times - times[0]
    speed = positive("speed", speed)
    count = min(len(times), int(np.ceil(times[-1] / STEP)) + 1)
    chosen = np.unique(np.searchsorted(times, np.linspace(0.0, times[-1], count)).clip(0, len(times) - 1))
    poses = np.stack([view._poses(qpos[i]) for i in chosen])  # (chosen, nodes, 4, 4)
    clips = {}
    for node, name in enumerate(view._paths):
        path = view.scene[f"{view.root}/{name}"].path
        clips[path] = _clip(times[chosen], poses[:, node])
    view.scene._clips[view.root] = clips
    view._place(poses[0])
    view.scene.window.send(_PlayCommand(ma.Animation(_all_clips(view.scene)), float("inf") if repeat else 1, speed))
    return view.scene.widget


def _all_clips(scene: Scene) -> dict:
    """Return the clips of all robots of a scene that have a motion."""
    return {path: clip for clips in scene._clips.values() for path, clip in clips.items()}


def _clip(times: np.ndarray, poses: np.ndarray) -> ma.AnimationClip:
    """Return the motion of one node, poses (n, 4, 4) at times (n,), without what interpolation gives back."""
    rotations = (np.ascontiguousarray(pose[:3, :3]) for pose in poses)
    quaternions = np.array([pinocchio.Quaternion(rotation).coeffs() for rotation in rotations])  # x, y, z, w
    flips = np.cumprod(np.where((quaternions[1:] * quaternions[:-1]).sum(1) < 0.0, -1.0, 1.0))
    quaternions[1:] *= flips[:, None]
    values = np.hstack([poses[:, :3, 3], quaternions])
    keep = np.zeros(len(times), dtype=bool)
    keep[[0, -1]] = True
    stack = [(0, len(times) - 1)]
    while stack:  # halve each stretch where a straight line misses the motion most
        a, b = stack.pop()
        if b - a < 2:
            continue
        share = ((times[a + 1 : b] - times[a]) / (times[b] - times[a]))[:, None]
        miss = np.abs(values[a + 1 : b] - (1 - share) * values[a] - share * values[b]).max(1)
        worst = int(miss.argmax())
        if miss[worst] > TOLERANCE:
            keep[a + 1 + worst] = True
            stack += [(a, a + 1 + worst), (a + 1 + worst, b)]
    frames = times[keep].tolist()
    tracks = {
        "position": _Track("position", "vector3", frames, poses[keep, :3, 3]),
        "quaternion": _Track("quaternion", "quaternion", frames, quaternions[keep]),
    }
    return ma.AnimationClip(tracks, fps=1)
