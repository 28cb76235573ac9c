# SPDX-License-Identifier: Apache-2.0
# Written by python/stubs.py.
from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple, TypedDict, Union, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

_Numbers = Union[Sequence[float], NDArray[np.floating[Any]], NDArray[np.integer[Any]]]

class _MeshInfo(TypedDict):
    triangles: int
    vertices: int
    parts: int
    duplicates: int
    degenerate: int
    open_edges: int
    odd_edges: int
    components: int
    closed: bool
    low: Tuple[float, ...]
    high: Tuple[float, ...]
    volume: float
    names: List[str]

class _FieldCheck(TypedDict):
    agrees: bool
    drains: bool
    leak: Tuple[float, ...]
    worst_node: float
    worst_between: float
    wall_hundredth: float
    wall_median: float
    gap_hundredth: float
    gap_median: float
    pushed: int
    holding_force: float
    weakest: Tuple[float, ...]

class _Safety(TypedDict):
    state: str
    fault: str
    frames: Dict[str, int]

class Error(RuntimeError):
    """Why a call failed, in one sentence; `code` names the kind of failure."""
    code: str

class Batch:
    """Many sessions of one model, stepped in one call on several threads. Each has the bits
    that it has alone, on any number of threads. Its arrays are views of what the batch owns;
    keep them."""
    def __init__(self, model: Model, definition: Definition, count: int, threads: int = 0) -> None:
        """count sessions of this definition; threads: 1 .. 64, 0: one for each core. Keep
        definition.max_contacts small: that is most of a session's memory."""
    def __len__(self) -> int:
        """How many sessions there are."""
    @property
    def body(self) -> NDArray[np.float64]:
        """(count, hands, 13) pose and velocity of each hand's body"""
    @property
    def buttons(self) -> NDArray[np.uint32]:
        """(count, hands)"""
    @property
    def causes(self) -> NDArray[np.uint32]:
        """(count, hands) bits"""
    @property
    def command(self) -> NDArray[np.float64]:
        """(count, hands, 6) wrench on each hand [N, N m]"""
    @property
    def command_pose(self) -> NDArray[np.float64]:
        """(count, hands, 7)"""
    @property
    def contacts(self) -> NDArray[np.uint32]:
        """(count,) points that touch"""
    @property
    def hands(self) -> int:
        """how many each session has"""
    @property
    def max_depth(self) -> NDArray[np.float64]:
        """(count,) [m]"""
    @property
    def max_depth_voxels(self) -> NDArray[np.float64]:
        """(count,)"""
    @property
    def model(self) -> Model:
        """that all sessions share"""
    @property
    def pose(self) -> NDArray[np.float64]:
        """(count, hands, 7) samples, to be written [m]"""
    def reset(self, which: Optional[Sequence[int]] = None, poses: Optional[ArrayLike] = None) -> None:
        """Begins sessions anew (None: all), the bodies of their hands at poses (which,
        hands, 7), or where the definition puts them. Samples start there, at rest."""
    @property
    def state_hash(self) -> NDArray[np.uint64]:
        """(count,) uint64"""
    @property
    def status(self) -> NDArray[np.uint32]:
        """(count,) bits of the frames"""
    def step(self, steps: int = 1) -> int:
        """Each session takes `steps` frames with its samples; returns the status bits of
        all."""
    @property
    def threads(self) -> int:
        """that step the sessions"""
    @property
    def velocity(self) -> NDArray[np.float64]:
        """(count, hands, 6) of the samples [m/s, rad/s]"""
    @property
    def wrench(self) -> NDArray[np.float64]:
        """(count, hands, 6) of the samples, admittance modes [N, N m]"""

class Body:
    """What moves, or stands fast."""
    def __init__(self, *, com: _Numbers = ..., field: int = ..., fixed: bool = ..., inertia: _Numbers = ..., mass: float = ..., pose: _Numbers = ..., shell: int = ..., translation_only: bool = ..., velocity: _Numbers = ...) -> None:
        """Begins with the defaults; keywords set attributes."""
    @property
    def com(self) -> Tuple[float, ...]:
        """(3,) centre of mass, mesh frame [m]"""
    @com.setter
    def com(self, value: _Numbers) -> None: ...
    field: int
    """index into the model's fields; -1: none"""
    fixed: bool
    """never moves"""
    @property
    def inertia(self) -> Tuple[float, ...]:
        """(6,) xx yy zz xy xz yz about com [kg m^2]; zeros: from the shell's points"""
    @inertia.setter
    def inertia(self, value: _Numbers) -> None: ...
    mass: float
    """[kg]"""
    @property
    def pose(self) -> Tuple[float, ...]:
        """(7,) mesh frame -> world at the start [m]"""
    @pose.setter
    def pose(self, value: _Numbers) -> None: ...
    shell: int
    """index into the model's shells; -1: none"""
    translation_only: bool
    """3-DoF: never turns"""
    @property
    def velocity(self) -> Tuple[float, ...]:
        """(6,) of the centre of mass, linear and angular [m/s, rad/s]"""
    @velocity.setter
    def velocity(self, value: _Numbers) -> None: ...

class Contact:
    """How contacts push and share their stiffness."""
    def __init__(self, *, cluster_voxels: float = ..., damping: float = ..., epsilon: float = ..., epsilon_normal: float = ..., epsilon_torque: float = ..., firmness: float = ..., firmness_shallow: float = ..., fit: str = ..., fit_offset: float = ..., friction: float = ..., global_n0: float = ..., margin_voxels: float = ..., method: str = ..., passivity: bool = ..., series_c: float = ..., stiffness: float = ..., torque_length: float = ...) -> None:
        """Begins with the defaults; keywords set attributes."""
    cluster_voxels: float
    """`cluster`: contacts nearer are one [voxel]"""
    damping: float
    """beta: damping over stiffness [s]"""
    epsilon: float
    """`gauss3`, `gauss6`: half-width of the hat, (0, 2]"""
    epsilon_normal: float
    """`robust`: half-width over normals"""
    epsilon_torque: float
    """`robust`: half-width over torques"""
    firmness: float
    """`firm`: rho, in units of k"""
    firmness_shallow: float
    """`firm`: rho near the surface"""
    fit: str
    """overlap at the start: 'relieve' (default) or 'tight'"""
    fit_offset: float
    """play [m]"""
    friction: float
    """mu, 0 .. 10"""
    global_n0: float
    """`global`: contacts above which they share"""
    margin_voxels: float
    """`series`, `firm`: takes part before it touches"""
    method: str
    """Weight rule: 'firm' (default), 'robust', 'series', 'global', ..."""
    passivity: bool
    """damp energy that contacts would make"""
    series_c: float
    """`series`, `firm`: net stiffness is at most c k"""
    stiffness: float
    """k of one contact [N/m]; 0: derived"""
    torque_length: float
    """l0 [m]; 0: derived"""

class Contacts:
    """Contacts of a shell body in the last frame: views, valid until the next step (later
    they show whatever is there then). World frame. Rows with depth <= 0 are about to touch."""
    def __len__(self) -> int:
        """How many rows there are."""
    @property
    def arm(self) -> NDArray[np.float32]:
        """(n, 3) float32, from the centre of mass [m]"""
    @property
    def depth(self) -> NDArray[np.float32]:
        """(n,) float32 [m]"""
    @property
    def field_body(self) -> NDArray[np.int32]:
        """(n,) int32, the body whose field it touches"""
    @property
    def gradient(self) -> NDArray[np.float32]:
        """(n, 3) float32, unit gradient of the field, outward"""
    @property
    def load(self) -> NDArray[np.float32]:
        """(n,) float32, force along the normal over k [m]"""
    def names(self) -> Tuple[NDArray[np.int32], NDArray[np.int32]]:
        """part (n,), triangle (n,) int32 of the field's mesh that each touches; -1: not
        known. Call it before the next step."""
    @property
    def normal(self) -> NDArray[np.float32]:
        """(n, 3) float32, inward unit normal; `firm`: direction of the push"""
    @property
    def point(self) -> NDArray[np.uint32]:
        """(n,) uint32, index into the shell's points"""
    @property
    def torque_direction(self) -> NDArray[np.float32]:
        """(n, 3) float32"""
    @property
    def weight(self) -> NDArray[np.float32]:
        """(n,) float32, share of the stiffness"""

class Coupling:
    """The virtual coupling between a hand and its body."""
    def __init__(self, *, damping_ratio: float = ..., max_depth_voxels: float = ..., max_force: float = ..., max_step_voxels: float = ..., max_torque: float = ..., mode: str = ..., rotational_stiffness: float = ..., stiffness: float = ...) -> None:
        """Begins with the defaults; keywords set attributes."""
    damping_ratio: float
    """1 is critical"""
    max_depth_voxels: float
    """largest force is k times this [voxel]"""
    max_force: float
    """[N]; 0: derived"""
    max_step_voxels: float
    """static: most way in a frame [voxel]"""
    max_torque: float
    """[N m]; 0: derived"""
    mode: str
    """'dynamic' (default), 'static' or 'direct'"""
    rotational_stiffness: float
    """[N m/rad]; 0: derived"""
    stiffness: float
    """k_VC [N/m]"""

class Definition:
    """A session's bodies, hands, pairs and settings."""
    def __init__(self, *, bodies: Sequence[Body] = ..., contact: Contact = ..., exact_gradient: bool = ..., frame_budget_us: float = ..., gravity: _Numbers = ..., hands: Sequence[Hand] = ..., implicit: bool = ..., max_contacts: int = ..., max_pairs: int = ..., max_substeps: int = ..., net_stiffness: bool = ..., pairs: Sequence[Sequence[int]] = ..., rate: float = ..., threads: int = ...) -> None:
        """Begins with the defaults; keywords set attributes."""
    @property
    def bodies(self) -> Tuple[Body, ...]:
        """tuple of Body, which may be changed; assign a new sequence for others"""
    @bodies.setter
    def bodies(self, value: Sequence[Body]) -> None: ...
    contact: Contact
    """Contact"""
    exact_gradient: bool
    """default False"""
    frame_budget_us: float
    """anytime mode [us]; 0: off"""
    @property
    def gravity(self) -> Tuple[float, ...]:
        """(3,) [m/s^2]"""
    @gravity.setter
    def gravity(self, value: _Numbers) -> None: ...
    @property
    def hands(self) -> Tuple[Hand, ...]:
        """tuple of Hand, at most 8"""
    @hands.setter
    def hands(self, value: Sequence[Hand]) -> None: ...
    implicit: bool
    """default True"""
    max_contacts: int
    """room, per shell body"""
    max_pairs: int
    """room for pairs that are near; 0: derived"""
    max_substeps: int
    """most steps of a frame, 1 .. 64"""
    net_stiffness: bool
    """report it in each frame"""
    @property
    def pairs(self) -> Tuple[Tuple[int, int], ...]:
        """tuple of (shell body, field body); empty: every moving shell against every
        other field"""
    @pairs.setter
    def pairs(self, value: Sequence[Sequence[int]]) -> None: ...
    rate: float
    """frames a second [Hz]"""
    threads: int
    """that share a frame's work, 1 .. 64"""

class Field:
    """A signed distance field in sparse bricks. Its arrays are views without copies."""
    def __init__(self, samples: ArrayLike, brick_index: ArrayLike, far_grid: ArrayLike, *, origin: _Numbers, voxel_size: float, band: float) -> None:
        """A field of your own: arrays as the properties of these names show them, copied.
        Where they are no field, Model says why. Every cell with a point nearer than band
        [m] to the surface must have its 8 nodes in bricks, and far_grid must not exceed
        the distance."""
    @property
    def band(self) -> float:
        """[m]"""
    @property
    def brick_index(self) -> NDArray[np.int32]:
        """(bz, by, bx) int32: row in `samples`, -1: no brick"""
    @property
    def far_grid(self) -> NDArray[np.float32]:
        """(bz + 1, by + 1, bx + 1) float32: bounds of the distance at nodes (8a, 8b, 8c)
        [m]"""
    @property
    def origin(self) -> Tuple[float, ...]:
        """(3,) node (0, 0, 0), mesh frame [m]"""
    @staticmethod
    def read(file: str) -> Field:
        """A .vdb."""
    @property
    def samples(self) -> NDArray[np.float32]:
        """(bricks, 8, 8, 8) float32, axes brick, z, y, x: signed distance [m]"""
    @property
    def voxel_size(self) -> float:
        """[m]"""
    def write(self, file: str) -> None:
        """A .vdb."""

class Filter:
    """Between a device and the scene: scales and clutch."""
    def __init__(self, *, clutch_buttons: int = ..., force_scale: float = ..., motion_scale: float = ..., relative: bool = ..., rotation_scale: float = ...) -> None:
        """Begins with the defaults; keywords set attributes."""
    clutch_buttons: int
    """bits"""
    force_scale: float
    """newtons at the device per newton in the scene"""
    motion_scale: float
    """metres in the scene per metre of the device"""
    relative: bool
    """the first sample takes the body where it is"""
    rotation_scale: float
    """the same for angles"""

class Hand:
    """What holds a body."""
    def __init__(self, *, admittance_damping: float = ..., body: int = ..., coupling: Coupling = ..., delay_frames: int = ..., delay_known: bool = ..., driver_damping: float = ..., driver_stiffness: float = ..., filter: Filter = ..., manipulandum_mass: float = ..., mode: str = ..., passivity: bool = ..., safety: Safety = ...) -> None:
        """Begins with the defaults; keywords set attributes."""
    admittance_damping: float
    """[N s/m]"""
    body: int
    """index of the body that moves with this hand"""
    coupling: Coupling
    """Coupling"""
    delay_frames: int
    """0 .. 2"""
    delay_known: bool
    """always exactly so many"""
    driver_damping: float
    """[N s/m]"""
    driver_stiffness: float
    """[N/m]"""
    filter: Filter
    """Filter"""
    manipulandum_mass: float
    """[kg]"""
    mode: str
    """'impedance' (default), 'admittance' or 'pseudo-admittance'"""
    passivity: bool
    """observe the energy that leaves through this hand"""
    safety: Safety
    """Safety"""

class Mesh:
    """Triangles."""
    def __init__(self, vertices: ArrayLike, triangles: ArrayLike, part: Optional[ArrayLike] = None) -> None:
        """vertices (n, 3) [m], triangles (m, 3) rows of vertices, part (m,) or None.
        Copied."""
    @property
    def info(self) -> _MeshInfo:
        """dict: triangles, vertices, parts, duplicates, degenerate, open_edges,
        odd_edges, components, closed, low, high [m], volume [m^3], names"""
    @staticmethod
    def parse(bytes: bytes, name: str, unit: str = 'm') -> Mesh:
        """The same from memory; the ending of `name` tells the format."""
    @staticmethod
    def read(file: str, unit: str = 'm') -> Mesh:
        """STL, OBJ, PLY, glTF, COLLADA, each also .gz. `unit` ('m', 'mm', 'cm', 'in') is
        that of a format that has none."""

class Model:
    """Fields and shells, immutable, shared by sessions."""
    def __init__(self, fields: Sequence[Field], shells: Sequence[Shell]) -> None:
        """Copies fields and shells, whose places here are the indices that bodies name.
        An Error says which of them is damaged."""
    @property
    def bytes(self) -> int:
        """memory that the model holds"""
    def sample_field(self, field: int, points: ArrayLike) -> Tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
        """points (n, 3) in the field's mesh frame [m] -> distance (n,) [m], gradient (n,
        3), exact (n,) bool: a sample, not a bound"""
    def stiffness_for(self, definition: Definition) -> float:
        """The contact stiffness that such a session has [N/m]; 0: not valid."""

class Recorder:
    """Writes a recording (.h5); a killed program loses at most half a second of it."""
    def __init__(self, file: str, scene: Optional[Scene] = None, definition: Optional[Definition] = None, program: str = 'python') -> None:
        """Of a run of `scene`, which is kept in the recording, or of a session with this
        `definition`."""
    def finish(self, summary: Optional[str] = None) -> None:
        """Makes the file. summary: one JSON object, or None."""
    @overload
    def record(self, session: Session) -> None:
        """Adds the session's last frame, a whole one also where another thread steps it."""
    @overload
    def record(self, frames: NDArray[np.void]) -> None:
        """Adds the rows that Session.follow returned; shapes of bodies that bend are not
        in them and stand as NaN."""

class Recording:
    """A recorded run, or what a killed run left of one."""
    def __init__(self, file: str) -> None:
        """An .h5 file. Frames are read when they are asked for; an Error says why a file
        is none."""
    def __len__(self) -> int:
        """How many frames there are."""
    def bends(self, first: int = 0, count: Optional[int] = None) -> Dict[int, NDArray[np.float64]]:
        """The same frames of the bodies that bend: {index of the body: (n, r) coordinates
        q [m sqrt(kg)]}, NaN where they are not known; {} where nothing bends, and of
        older recordings."""
    @property
    def events(self) -> List[Tuple[float, str, str]]:
        """list of (time [s], what, detail)"""
    def frames(self, first: int = 0, count: Optional[int] = None) -> NDArray[np.void]:
        """Rows first .. first + count as a structured array: ['time'] [s],
        ['report']['contacts'], ['hand'] (n, 8), ['command'], ['body'], ...; the member
        names of h6FrameRecord"""
    @property
    def hands(self) -> int:
        """how many each frame has"""
    @property
    def program(self) -> str:
        """name and version of what recorded it"""
    @property
    def rate(self) -> float:
        """[Hz]"""
    @property
    def scene(self) -> str:
        """JSON, or ''"""
    @property
    def summary(self) -> str:
        """JSON, or ''"""
    @property
    def whole(self) -> bool:
        """False: the run was killed"""

class Safety:
    """The safety chain of a hand's output. 0: the device's rating."""
    def __init__(self, *, cut_speed: float = ..., dead_man_buttons: int = ..., decay_time: float = ..., derate_speed: float = ..., freeze_time: float = ..., max_force: float = ..., max_force_rate: float = ..., max_power: float = ..., max_speed: float = ..., max_torque: float = ..., max_torque_rate: float = ..., pose_jump: float = ..., soft_start: float = ...) -> None:
        """Begins with the defaults; keywords set attributes."""
    cut_speed: float
    """[m/s]"""
    dead_man_buttons: int
    """bits"""
    decay_time: float
    """[s]"""
    derate_speed: float
    """[m/s]"""
    freeze_time: float
    """[s]"""
    max_force: float
    """[N]"""
    max_force_rate: float
    """slew limit [N/s]"""
    max_power: float
    """[W]"""
    max_speed: float
    """admittance [m/s]"""
    max_torque: float
    """[N m]"""
    max_torque_rate: float
    """slew limit [N m/s]"""
    pose_jump: float
    """[m]"""
    soft_start: float
    """[s]"""

class Scene:
    """Parts, hands and rules of a scene file."""
    def __init__(self, name: str, *, outside: bool = False, progress: Optional[Callable[[str, float], Optional[bool]]] = None) -> None:
        """A scene file (.json) or a generated scene ('peg-in-hole'). Assets are baked, or
        come from the cache. outside: files outside the scene's folder may be read."""
    @property
    def bodies(self) -> Tuple[str, ...]:
        """names of bodies, in the order of their indices"""
    def definition(self) -> Definition:
        """A new Definition of a session, to be changed at will."""
    @property
    def duration(self) -> float:
        """[s]"""
    @property
    def model(self) -> Model:
        """made of the scene's parts; it lives as long as the scene"""
    def path(self, hand: int, time: float) -> Tuple[Tuple[float, ...], Tuple[float, ...]]:
        """Where the scene's hand wants to be at a time [s]: pose (7,), velocity (6,)."""

class Session:
    """Bodies, hands and their state. Threads that share one take turns, call by call; its
    arrays are views, which a step of another thread changes."""
    def __init__(self, model: Model, definition: Definition) -> None:
        """Each hand's sample begins where its body is, at rest."""
    def arm(self) -> None:
        """Clears faults and starts again softly."""
    @property
    def bodies(self) -> int:
        """how many there are"""
    def body(self, body: int) -> NDArray[np.float64]:
        """(13,) pose (7) and velocity (6) of a body; a copy, to be kept. `states` is a
        view."""
    @property
    def buttons(self) -> NDArray[np.uint32]:
        """(hands,)"""
    @property
    def causes(self) -> NDArray[np.uint32]:
        """(hands,) bits: cause_names"""
    @property
    def command(self) -> NDArray[np.float64]:
        """(hands, 6) wrench on each hand after the last step [N, N m]"""
    @property
    def command_pose(self) -> NDArray[np.float64]:
        """(hands, 7)"""
    def contacts(self, body: int) -> Contacts:
        """Contacts of a shell body in the last frame, as views."""
    def coupling(self, hand: int) -> Coupling:
        """The Coupling in use, with derived values."""
    def deformation(self, body: int) -> NDArray[np.float64]:
        """(r,) coordinates q of a body whose shell bends [m sqrt(kg)], (0,) of others; a
        copy, since it is small"""
    def disarm(self) -> None:
        """Lets every output decay to zero."""
    def follow(self, poses: ArrayLike) -> NDArray[np.void]:
        """A frame for each row of poses (n, hands, 7), without the interpreter; the
        frames as a structured array (n,), the rows of a recording."""
    @property
    def frame(self) -> NDArray[np.void]:
        """The last frame's report, a structured scalar: frame['contacts'], ['max_depth']
        [m], ['frame_us'], ['state_hash'], ...; a copy, to be kept. `report` is a view."""
    @property
    def hands(self) -> int:
        """how many there are"""
    @property
    def model(self) -> Model:
        """whose fields and shells it uses"""
    def note_interval(self, seconds: float) -> None:
        """From the last commands to the next [s], for a loop in real time."""
    @property
    def overlaps(self) -> NDArray[np.void]:
        """Overlaps at the start, a structured array; a copy, since there are few and a
        step changes none"""
    @property
    def pose(self) -> NDArray[np.float64]:
        """(hands, 7) sample of each hand, to be written [m]"""
    @property
    def rate(self) -> float:
        """[Hz]"""
    @property
    def report(self) -> NDArray[np.void]:
        """The last frame's report, a structured scalar with the members of `frame`: a
        view, which shows the next step, too. Take it once, before the loop."""
    def restart_fit(self) -> None:
        """Makes the present poses a new start."""
    def safety(self, hand: int) -> _Safety:
        """dict: state, fault, frames with each cause"""
    def set_body(self, body: int, pose: _Numbers, velocity: _Numbers = ...) -> None:
        """Teleports a body; an overlap that it makes pushes in full."""
    @property
    def states(self) -> NDArray[np.float64]:
        """(bodies, 13) pose (7) and velocity (6) of each body after the last step: a
        view, which shows the next step, too. Once it was taken, each step takes the time
        to fill it."""
    @overload
    def step(self) -> int:
        """One frame with what stands in `pose`, `velocity`, `wrench` and `buttons`;
        returns the status bits (status_names), 0: nothing was dropped or limited."""
    @overload
    def step(self, pose: ArrayLike) -> int:
        """Puts this sample of each hand, (hands, 7), in place first."""
    @overload
    def step(self, pose: ArrayLike, velocity: Optional[ArrayLike] = None, wrench: Optional[ArrayLike] = None, buttons: Optional[int] = None) -> int:
        """Puts these samples, (hands, 7) and (hands, 6), in place first."""
    @property
    def velocity(self) -> NDArray[np.float64]:
        """(hands, 6) of the samples [m/s, rad/s]"""
    def voxel(self, body: int) -> float:
        """[m]"""
    @property
    def wrench(self) -> NDArray[np.float64]:
        """(hands, 6) of the samples, in the admittance modes [N, N m]"""

class Shell:
    """Points that may touch, coarse ones first. Its arrays are views without copies."""
    def __init__(self, points: ArrayLike, normals: ArrayLike) -> None:
        """A shell of your own: points (n, 3) [m] and their inward unit normals (n, 3),
        copied, in one level: each is looked at in every frame near the field. For more
        than some thousand points bake_shell is faster."""
    def __len__(self) -> int:
        """How many points there are."""
    @property
    def nx(self) -> NDArray[np.float32]:
        """(points,) float32, inward unit normal"""
    @property
    def ny(self) -> NDArray[np.float32]:
        """(points,) float32, inward unit normal"""
    @property
    def nz(self) -> NDArray[np.float32]:
        """(points,) float32, inward unit normal"""
    @staticmethod
    def read(file: str) -> Shell:
        """A .ply."""
    def write(self, file: str) -> None:
        """A .ply."""
    @property
    def x(self) -> NDArray[np.float32]:
        """(points,) float32, mesh frame [m]"""
    @property
    def y(self) -> NDArray[np.float32]:
        """(points,) float32, mesh frame [m]"""
    @property
    def z(self) -> NDArray[np.float32]:
        """(points,) float32, mesh frame [m]"""

def bake_field(mesh: Mesh, *, progress: Optional[Callable[[str, float], Optional[bool]]] = None, voxels: int = ..., voxel_size: float = ..., tolerance: float = ..., offset: float = ..., sign: str = ..., hollow: bool = ..., seal: float = ..., weld: float = ..., band_voxels: float = ..., threads: int = ..., cache: bool = ...) -> Field:
    """A Field of a Mesh. Options: voxels (256), voxel_size [m], tolerance [m], offset [m],
    sign ('auto', 'flood', 'winding'), hollow, seal [m], weld [voxel], band_voxels (3),
    threads (0: all), cache (False). progress(what, done) may return False to cancel."""

def bake_shell(mesh: Mesh, *, progress: Optional[Callable[[str, float], Optional[bool]]] = None, points: int = ..., spacing: float = ..., levels: int = ..., seed: int = ..., surface: str = ..., normals: str = ..., voxels: int = ..., voxel_size: float = ..., tolerance: float = ..., offset: float = ..., sign: str = ..., hollow: bool = ..., seal: float = ..., weld: float = ..., band_voxels: float = ..., threads: int = ..., cache: bool = ...) -> Shell:
    """A Shell of a Mesh. Options: points (10000), spacing [m], levels (7), seed, surface and
    normals ('auto', 'triangles', 'field'), and those of bake_field for the field that finds
    what the outside reaches."""

def build_info() -> str:
    """Version, compiler and SIMD targets of the library, as a line."""

def cause_names(causes: int) -> Tuple[str, ...]:
    """The names of the bits of `causes`."""

def check_field(mesh: Mesh, field: Field, *, stiffness: float = 10000.0, points: int = 20000, push: bool = True, threads: int = 0, progress: Optional[Callable[[str, float], Optional[bool]]] = None) -> _FieldCheck:
    """Compares a field with its mesh; dict as h6CheckReport, lengths in m, force in N."""

def set_log(function: Optional[Callable[[str, str], None]]) -> None:
    """Calls function(level, sentence) for what no call returns: what a bake repaired, how a
    session starts. level is 'note' or 'warning'. None, the default: silence."""

def status_names(status: int) -> Tuple[str, ...]:
    """The names of the bits of a status."""

def weigh(normals: ArrayLike, arms: ArrayLike, depths: ArrayLike, *, voxel: float, lever: float, gradients: Optional[ArrayLike] = None, velocity: Optional[_Numbers] = None, contact: Optional[Contact] = None, exact: bool = False) -> Tuple[NDArray[np.float32], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Weights of any simulator's contacts: normals (n, 3) unit, the direction of the push;
    arms (n, 3) from the centre of mass [m]; depths (n,) > 0 inside [m]; voxel: the length of
    l0 and clusters [m]; lever: at least the largest arm, the same in every call [m]; velocity
    (6,) of the body. Returns weights (n,), wrench (6,) [N, N m], stiffness (6, 6) and damping
    (6, 6), its derivatives by q = (x, theta) and by velocity."""

