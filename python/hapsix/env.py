# SPDX-License-Identifier: Apache-2.0
"""Assembly tasks with the interface of Gymnasium; Gymnasium itself is used where it is installed.

    env = hapsix.env.AssemblyEnv()                      # peg in hole; TASKS has the others
    observation, info = env.reset(seed=1)
    observation, reward, terminated, truncated, info = env.step(env.action_space.sample())

    many = hapsix.env.AssemblyVectorEnv(num_envs=1024)  # the same for many at once: arrays

An action moves the hand, not the part: the coupling pulls the part after it, and contacts hold it.
Every force is one that a person would have felt. The same seed and actions give the same bits.
"""
import dataclasses

import numpy as np

import hapsix

try:
    import gymnasium
    from gymnasium.spaces import Box
    from gymnasium.vector import VectorEnv as _VectorBase
    _Base = gymnasium.Env
except ImportError:
    _Base = _VectorBase = object

    class Box:
        """What Gymnasium's Box is here: bounds, a shape, samples."""

        def __init__(self, low, high, shape, dtype=np.float32, seed=None):
            self.shape, self.dtype = tuple(shape), np.dtype(dtype)
            self.low = np.full(shape, low, dtype)
            self.high = np.full(shape, high, dtype)
            self.seed(seed)

        def seed(self, seed=None):
            self._random = np.random.default_rng(seed)

        def sample(self):
            low, high = np.maximum(self.low, -1e3), np.minimum(self.high, 1e3)
            return self._random.uniform(low, high).astype(self.dtype)

        def contains(self, x):
            x = np.asarray(x)
            return x.shape == self.shape and bool(np.all(x >= self.low) and np.all(x <= self.high))


@dataclasses.dataclass(frozen=True)
class Task:
    """Where the part of a scene's first hand starts and where it belongs; mesh frame, world."""

    scene: str                 # a generated scene or a file
    start: tuple               # (3,) middle of the starts [m]
    goal: tuple                # (3,) [m]; the orientation there is that of the scene's definition
    spread: tuple              # (3,) starts lie within this of the middle [m]
    tilt: float                # ... turned by up to this about any axis [rad]
    tolerance: float           # how near to the goal is there [m]
    reach: float = 5e-4        # most way of the hand in an action [m]
    turn: float = np.radians(0.5)   # most turn of the hand in an action [rad]
    lead: float = 5e-3         # the hand stays this near to the part [m]
    lead_turn: float = np.radians(30)  # ... and turned against it by no more than this [rad]
    frames: int = 10           # that an action lasts: 10 ms at 1 kHz
    actions: int = 400         # after which an episode is truncated
    max_contacts: int = 1000   # room in each session


PEG_IN_HOLE = Task("peg-in-hole", start=(0, 0, 17e-3), goal=(0, 0, -15e-3), spread=(2e-3, 2e-3, 1e-3),
                   tilt=np.radians(2), tolerance=5e-4)
# The shaft must be turned so that its 24 teeth meet the gaps.
SHAFT_IN_HUB = Task("spline-hub-1k", start=(0, 0, 45e-3), goal=(0, 0, 0), spread=(1e-3, 1e-3, 1e-3),
                    tilt=np.radians(3), tolerance=5e-4, max_contacts=2000)
# The thread, with a pitch of 4 mm, lets the nut down only as it turns: by one turn and a half.
NUT_ON_BOLT = Task("nut-on-bolt", start=(0, 0, 3e-3), goal=(0, 0, -6e-3), spread=(5e-4, 5e-4, 5e-4),
                   tilt=np.radians(2), tolerance=5e-4, turn=np.radians(4), lead=2e-3, max_contacts=2000)
# The gear of 18 teeth must be turned so that they meet the gaps of two other gears at once.
GEAR_MESH = Task("gear-train", start=(0, 0, 20e-3), goal=(0, 0, 0), spread=(1e-3, 1e-3, 1e-3),
                 tilt=np.radians(3), tolerance=5e-4, max_contacts=2000)
TASKS = {"peg-in-hole": PEG_IN_HOLE, "shaft-in-hub": SHAFT_IN_HUB, "nut-on-bolt": NUT_ON_BOLT,
         "gear-mesh": GEAR_MESH}


def _task_of(task):
    if isinstance(task, Task):
        return task
    if task in TASKS:
        return TASKS[task]
    raise ValueError(f"there is no task {task!r}: " + ", ".join(TASKS))


OBSERVATION = 22
_MM, _FORCE, _TORQUE = 1e-3, 10.0, 0.1


def _turned(q, turns):
    """Quaternions (n, 4) turned by rotation vectors (n, 3) in the world frame."""
    angle = np.linalg.norm(turns, axis=1, keepdims=True)
    half = 0.5 * angle
    scale = np.where(angle > 1e-12, np.sin(half) / np.maximum(angle, 1e-12), 0.5)
    w, v = np.cos(half)[:, 0], turns * scale
    out = np.empty_like(q)
    out[:, 0] = w * q[:, 0] - np.sum(v * q[:, 1:], axis=1)
    out[:, 1:] = w[:, None] * q[:, 1:] + q[:, :1] * v + np.cross(v, q[:, 1:])
    return out / np.linalg.norm(out, axis=1, keepdims=True)


def _times(p, q):
    """Products of quaternions (n, 4)."""
    w = p[:, 0] * q[:, 0] - np.sum(p[:, 1:] * q[:, 1:], axis=1)
    v = p[:, :1] * q[:, 1:] + q[:, :1] * p[:, 1:] + np.cross(p[:, 1:], q[:, 1:])
    return np.concatenate((w[:, None], v), axis=1)


def _near(q, to, most):
    """Quaternions q (n, 4), turned back so far that each is within `most` [rad] of `to`."""
    between = _times(q, to * (1, -1, -1, -1))
    between = np.where(between[:, :1] < 0, -between, between)
    sine = np.linalg.norm(between[:, 1:], axis=1, keepdims=True)
    angle = 2 * np.arctan2(sine, between[:, :1])
    turns = between[:, 1:] * (most / np.maximum(sine, 1e-12))
    return np.where(angle > most, _turned(to, turns), q)


def _autoreset_mode(same_step):
    """What Gymnasium's vector environments say in their metadata, from version 1.1 on."""
    modes = getattr(getattr(globals().get("gymnasium"), "vector", None), "AutoresetMode", None)
    return {"autoreset_mode": modes.SAME_STEP if same_step else modes.DISABLED} if modes else {}


class AssemblyVectorEnv(_VectorBase):
    """num_envs episodes of a task side by side, with the interface of gymnasium.vector.VectorEnv. With
    autoreset an episode that ends begins anew in the same step: infos["_final_obs"] (num_envs,) says which
    ended, and infos["final_obs"] (num_envs, 22) has their last observations. Without it they go on until
    reset(options={"reset_mask": (num_envs,) bool}) begins those anew.

    observation (num_envs, 22) float32: way to the goal (3) [mm], quaternion (4), velocity (6) [mm/s,
    rad/s], wrench on the hand (6) [10 N, 0.1 N m], way from the part to the hand (3) [mm]
    action (num_envs, 6) in -1 .. 1: way (3) and turn (3) of the hand, in units of the task's reach and turn

    task: one of TASKS, by name, or a Task of your own. threads: 0: one for each core.
    """

    metadata = {"render_modes": []}
    render_mode = None
    spec = None
    closed = False

    def __init__(self, num_envs=1, task=PEG_IN_HOLE, threads=0, autoreset=True):
        """The arguments are told above. Loads the task's scene, which takes seconds the first time."""
        task = _task_of(task)
        self.metadata = dict(self.metadata, **_autoreset_mode(autoreset))
        self.task, self.num_envs, self.autoreset = task, num_envs, autoreset
        self._scene = hapsix.Scene(task.scene)
        definition = self._scene.definition()
        definition.max_contacts = task.max_contacts
        self._upright = np.array(definition.bodies[definition.hands[0].body].pose[3:])
        self._batch = hapsix.Batch(self._scene.model, definition, num_envs, threads)
        self.single_observation_space = Box(-np.inf, np.inf, (OBSERVATION,), np.float32)
        self.single_action_space = Box(-1, 1, (6,), np.float32)
        self.observation_space = Box(-np.inf, np.inf, (num_envs, OBSERVATION), np.float32)
        self.action_space = Box(-1, 1, (num_envs, 6), np.float32)
        self._goal = np.asarray(task.goal, float)
        self._age = np.zeros(num_envs, int)
        self._seed(None)

    def _seed(self, seed):
        """One generator an episode, so that its starts do not depend on the others."""
        if seed is None or np.ndim(seed) == 0:
            seeds = [None if seed is None else seed + i for i in range(self.num_envs)]
        else:
            seeds = list(seed)
        if len(seeds) != self.num_envs:
            raise ValueError(f"{len(seeds)} seeds for {self.num_envs} environments")
        self._starts = [np.random.default_rng(s) for s in seeds]

    @property
    def batch(self):
        """The hapsix.Batch underneath."""
        return self._batch

    def reset(self, *, seed=None, options=None):
        """All episodes begin anew, or those of options["reset_mask"]: observations, infos. The same seed
        gives the same starts; episode i has seed + i, or seed[i] of a list."""
        if seed is not None:
            self._seed(seed)
        which = np.arange(self.num_envs)
        if options and "reset_mask" in options:
            mask = np.asarray(options["reset_mask"])
            if mask.shape != (self.num_envs,) or mask.dtype != bool:
                raise ValueError(f"reset_mask is ({self.num_envs},) of bool, not {mask.shape} of {mask.dtype}")
            which = np.flatnonzero(mask)
        self._begin(which)
        return self._observe(), {}

    def _begin(self, which):
        n = len(which)
        poses = np.empty((n, 1, 7))
        drawn = np.array([self._starts[i].uniform(-1, 1, 6) for i in which]).reshape(n, 6)
        poses[:, 0, :3] = self.task.start + drawn[:, :3] * self.task.spread
        poses[:, 0, 3:] = _turned(np.tile(self._upright, (n, 1)), drawn[:, 3:] * self.task.tilt)
        self._batch.reset(which.tolist(), poses)
        self._age[which] = 0

    def _observe(self):
        b = self._batch
        out = np.empty((self.num_envs, OBSERVATION), np.float32)
        out[:, 0:3] = (self._goal - b.body[:, 0, :3]) / _MM
        out[:, 3:7] = b.body[:, 0, 3:7]
        out[:, 7:10] = b.body[:, 0, 7:10] / _MM
        out[:, 10:13] = b.body[:, 0, 10:13]
        out[:, 13:16] = b.command[:, 0, :3] / _FORCE
        out[:, 16:19] = b.command[:, 0, 3:] / _TORQUE
        out[:, 19:22] = (b.pose[:, 0, :3] - b.body[:, 0, :3]) / _MM
        return out

    def step(self, actions):
        """Observations, rewards, terminated, truncated (num_envs,), infos. The reward of an action is
        how much nearer the part came [mm], less a hundredth for each newton beyond 5, and 10 at the goal.
        """
        task, b = self.task, self._batch
        actions = np.asarray(actions, float).reshape(self.num_envs, 6)
        if np.isnan(actions).any():
            raise ValueError("an action is not a number")
        actions = np.clip(actions, -1, 1)
        before = np.linalg.norm(self._goal - b.body[:, 0, :3], axis=1)
        ahead = b.pose[:, 0, :3] + task.reach * actions[:, :3] - b.body[:, 0, :3]
        length = np.linalg.norm(ahead, axis=1, keepdims=True)
        b.pose[:, 0, :3] = b.body[:, 0, :3] + ahead * np.minimum(1, task.lead / np.maximum(length, 1e-12))
        turned = _turned(b.pose[:, 0, 3:], task.turn * actions[:, 3:])
        b.pose[:, 0, 3:] = _near(turned, b.body[:, 0, 3:7], task.lead_turn)
        b.step(task.frames)
        self._age += 1
        distance = np.linalg.norm(self._goal - b.body[:, 0, :3], axis=1)
        force = np.linalg.norm(b.command[:, 0, :3], axis=1)
        terminated = distance < task.tolerance
        truncated = ~terminated & (self._age >= task.actions)
        rewards = (before - distance) / _MM - 0.01 * np.maximum(force - 5, 0) + 10.0 * terminated
        infos = {"distance": distance, "force": force, "contacts": b.contacts.copy(), "max_depth": b.max_depth.copy()}
        ended = terminated | truncated
        observations = self._observe()
        if self.autoreset and ended.any():
            infos["final_obs"], infos["_final_obs"] = observations, ended
            self._begin(np.flatnonzero(ended))
            observations = self._observe()
        return observations, rewards, terminated, truncated, infos

    def close(self, **kwargs):
        """Nothing is held open."""
        self.closed = True


class AssemblyEnv(_Base):
    """One episode of a task at a time, with the interface of gymnasium.Env; observation (22,) and action
    (6,) as AssemblyVectorEnv has them. An episode goes on until reset, also after its end."""

    metadata = {"render_modes": []}
    render_mode = None
    spec = None

    def __init__(self, task=PEG_IN_HOLE):
        """task: one of TASKS, by name, or a Task of your own."""
        self._many = AssemblyVectorEnv(1, task, threads=1, autoreset=False)
        self.observation_space = self._many.single_observation_space
        self.action_space = self._many.single_action_space

    def reset(self, *, seed=None, options=None):
        """observation (22,), info"""
        if _Base is not object:
            super().reset(seed=seed)
        observations, info = self._many.reset(seed=seed)
        return observations[0], info

    def step(self, action):
        """observation (22,), reward, terminated, truncated, info"""
        observations, rewards, terminated, truncated, infos = self._many.step(np.asarray(action)[None])
        info = {name: values[0] for name, values in infos.items()}
        return observations[0], float(rewards[0]), bool(terminated[0]), bool(truncated[0]), info

    def close(self):
        """Nothing is held open."""

