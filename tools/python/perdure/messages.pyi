from typing import Any, Dict, Iterator, List, Literal, Optional

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

SCHEMA: Dict[str, Any]
TOPIC_TYPES: Dict[str, str]
CLASSES: Dict[str, type]

def register(module: Any) -> None: ...

class Message:
    _fields: Any
    def __init__(self, **values: Any) -> None: ...
    def to_dict(self) -> Dict[str, Any]: ...

# The rest is made by tools/python/stubs.py of the topics' description; do not edit.
class Pose(Message):
    q_xyzw: npt.NDArray[np.float64]  # (4,), unit quaternion, w last
    p: npt.NDArray[np.float64]  # (3,), m
    @property
    def rotation(self) -> Array: ...  # (3, 3): takes directions of the second frame to the first; of ``T_WB``, B to W.
    @property
    def matrix(self) -> Array: ...  # (4, 4): takes points of the second frame to the first.
    def __matmul__(self, points: Any) -> Array: ...

class FrameStamp(Message):
    source: int  # which capture process made the frame
    sequence: int  # index of the frame in the drive
    time_ns: int  # ns, sensor clock, middle of the exposure
    captured_ns: int  # ns, CLOCK_MONOTONIC of capture's host

class Frame(Message):
    stamp: FrameStamp  # FrameStamp
    camera: str  # not empty
    width: int  # int
    height: int  # int
    encoding: Literal["mono8", "bgr8", "jpeg_mono8", "jpeg_bgr8"]  # mono8 | bgr8 | jpeg_mono8 | jpeg_bgr8
    pixels: npt.NDArray[np.uint8]  # (height, width) or (height, width, 3) uint8; of a JPEG its bytes
    @property
    def image(self) -> npt.NDArray[np.uint8]: ...  # (height, width) uint8, or (height, width, 3) in the order blue, green, red.

class ImuSample(Message):
    source: int  # int
    sequence: int  # int
    time_ns: int  # ns, sensor clock
    gyro: npt.NDArray[np.float64]  # (3,), rad/s, angular velocity and bias
    accel: npt.NDArray[np.float64]  # (3,), m/s², specific force and bias

class SpeedSample(Message):
    source: int  # int
    sequence: int  # int
    time_ns: int  # ns, sensor clock
    speed: float  # m/s
    sigma: float  # m/s, standard deviation

class CameraCalibration(Message):
    name: str  # not empty
    width: int  # int
    height: int  # int
    fx: float  # px
    fy: float  # px
    cx: float  # px
    cy: float  # px
    distortion: Literal["none", "radial_tangential", "equidistant", "rational"]  # none | radial_tangential | equidistant | rational
    distortion_coefficients: npt.NDArray[np.float64]  # (n,)
    T_BC: Pose  # camera in the body
    time_offset_s: float  # s
    readout_s: float  # s
    rate_hz: float  # Hz, nominal
    focal_sigma: float  # float
    centre_sigma_px: float  # float
    distortion_sigma: float  # float
    rotation_sigma: float  # float
    position_sigma_m: float  # float
    time_offset_sigma_s: float  # float

class ImuCalibration(Message):
    gyro_noise: float  # float
    gyro_bias_walk: float  # float
    accel_noise: float  # float
    accel_bias_walk: float  # float
    rate_hz: float  # float

class GeoAnchor(Message):
    time_ns: int  # ns, sensor clock
    latitude_deg: float  # °
    longitude_deg: float  # °
    height_m: float  # m
    yaw: float  # rad

class Calibration(Message):
    source: int  # int
    cameras: List[CameraCalibration]  # list of CameraCalibration
    imu: Optional[ImuCalibration]  # ImuCalibration or None
    has_speed: bool  # bool
    anchor: Optional[GeoAnchor]  # GeoAnchor or None

class WorldId(Message):
    world: int  # int
    epoch: int  # int

class Odometry(Message):
    stamp: FrameStamp  # FrameStamp
    instance: int  # of the process that made it
    world: WorldId  # WorldId
    state: Literal["initialising", "tracking", "degraded"]  # initialising | tracking | degraded
    T_WB: Pose  # pose
    v_WB: npt.NDArray[np.float64]  # (3,), m/s
    covariance: npt.NDArray[np.float64]  # (9, 9), symmetric, of [θ, p, v]: θ in the body, rad; p, m; v, m/s
    up_W: npt.NDArray[np.float64]  # (3,), of length 1, against gravity
    gyro_bias: npt.NDArray[np.float64]  # (3,), rad/s
    accel_bias: npt.NDArray[np.float64]  # (3,), m/s²
    has_increment: bool  # bool
    increment_from: int  # int
    transition: npt.NDArray[np.float64]  # (6, 6)
    increment_covariance: npt.NDArray[np.float64]  # (6, 6), symmetric

class Landmark(Message):
    id: int  # int
    p_W: npt.NDArray[np.float64]  # (3,), m, in W
    covariance: npt.NDArray[np.float64]  # (3, 3), symmetric, m², relative to the pose
    cross_pose: npt.NDArray[np.float64]  # (3, 6)
    pixel: npt.NDArray[np.float64]  # (2,), px, as seen, distorted
    descriptor: npt.NDArray[np.uint8]  # (32,), uint8

class Landmarks(Message):
    stamp: FrameStamp  # FrameStamp
    instance: int  # int
    world: WorldId  # WorldId
    camera: str  # not empty
    landmarks: List[Landmark]  # list of Landmark

class Detection(Message):
    x1: float  # px
    y1: float  # px
    x2: float  # px
    y2: float  # px
    activations: npt.NDArray[np.float32]  # (n,), float32, nats, K + 1 log-likelihoods: [0] clutter, [k] class k of the model. Only differences matter
    azimuth: Optional[float]  # rad, yaw less the bearing of the centre (KITTI's alpha)
    azimuth_sigma: float  # rad, standard deviation
    primed: bool  # answers a prediction that no box of its own met
    sigma_x1: float  # float
    sigma_y1: float  # float
    sigma_x2: float  # float
    sigma_y2: float  # float
    primed_for: int  # int
    @property
    def box(self) -> Array: ...  # (4,) x1, y1, x2, y2, px of the distorted image; x right, y down.
    @box.setter
    def box(self, value: Any) -> None: ...

class Detections(Message):
    stamp: FrameStamp  # FrameStamp
    camera: str  # not empty
    instance: int  # int
    model_hash: int  # int
    detections: List[Detection]  # list of Detection
    input_scale: float  # float
    forward_s: float  # s, of the forward pass; 0: not known

class ModelInfo(Message):
    hash: int  # int
    instance: int  # int
    name: str  # str
    classes: List[str]  # names
    input_width: int  # int
    input_height: int  # int
    box_sigma: float  # of a box's side over its size; 0: not known
    side_insets: npt.NDArray[np.float64]  # (n,)
    boxes: Literal["cuboid", "outline", "unknown"]  # cuboid | outline | unknown, what a box encloses: the image of its cuboid, or its own outline

class SwapNotice(Message):
    instance: int  # int
    about: int  # int
    step: Literal["rehearsing", "took_over", "passed", "rolled_back", "retired"]  # rehearsing | took_over | passed | rolled_back | retired
    probation_s: float  # float
    model: str  # str
    reason: str  # str
    detail: str  # str

class ClassBelief(Message):
    name: str  # not empty
    probability: float  # 0 to 1
    mean: npt.NDArray[np.float64]  # (7,), centre [m], yaw [rad], log of length, width, height [log m]
    covariance: npt.NDArray[np.float64]  # (7, 7), symmetric, positive definite, of mean
    cross_pose: npt.NDArray[np.float64]  # (7, 6), with the body's pose error [θ, p]
    @property
    def position(self) -> Array: ...  # (3,) centre, m.
    @property
    def yaw(self) -> float: ...  # rad, about the vertical.
    @property
    def size(self) -> Array: ...  # (3,) length, width, height, m.

class LedgerEntry(Message):
    log_odds: float  # nats
    count: int  # int
    first_ns: int  # ns, sensor clock
    last_ns: int  # ns, sensor clock

class ClassLedger(Message):
    name: str  # not empty
    log_odds: npt.NDArray[np.float64]  # (n,), nats

class OustedClass(Message):
    name: str  # not empty
    by: str  # not empty
    at_ns: int  # ns, sensor clock
    log_odds: npt.NDArray[np.float64]  # (n,), nats

class Ledger(Message):
    existence: List[LedgerEntry]  # list of LedgerEntry
    classes: List[ClassLedger]  # list of ClassLedger
    ousted: List[OustedClass]  # list of OustedClass

class ObjectBelief(Message):
    id: int  # int
    existence: float  # 0 to 1, that it exists
    confirmed: bool  # bool
    classes: List[ClassBelief]  # list of ClassBelief
    visibility: Literal["visible", "partial", "occluded", "out_of_view", "behind"]  # visible | partial | occluded | out_of_view | behind
    visible_fraction: float  # 0 to 1, of its outline
    blocked_by: int  # id of what hides it; 0: nothing, or no object
    first_seen_ns: int  # ns, sensor clock
    last_seen_ns: int  # ns, sensor clock
    as_of_ns: int  # ns, sensor clock
    hits: int  # looks that showed it
    visible_misses: int  # int
    moving: float  # 0 to 1, that it moves
    velocity: npt.NDArray[np.float64]  # (3,), m/s, in W; 0 while it stands
    memory: Literal["working", "long_term"]  # working | long_term
    recalled: bool  # bool
    why: Ledger  # Ledger, the evidence for it, in nats
    track: int  # int
    seen_from: npt.NDArray[np.float64]  # (16,)
    @property
    def position(self) -> Array: ...  # (3,) centre, m.
    @property
    def yaw(self) -> float: ...  # rad, about the vertical.
    @property
    def size(self) -> Array: ...  # (3,) length, width, height, m.
    @property
    def best(self) -> ClassBelief: ...  # The most probable ClassBelief.
    @property
    def class_name(self) -> str: ...  # Name of the most probable class.
    @property
    def class_names(self) -> List[str]: ...  # Names of the classes, as ``pmf`` is ordered: the most probable first.
    @property
    def pmf(self) -> Array: ...  # (K,) probabilities of the classes, given that the object exists; they sum to 1.
    @property
    def mean(self) -> Array: ...  # (7,) of the most probable class: centre, m; yaw, rad; log of length, width, height.
    @property
    def covariance(self) -> Array: ...  # (7, 7) of ``mean``.

class EndedTrack(Message):
    track: int  # int
    into: int  # int
    time_ns: int  # ns, sensor clock

class Objects(Message):
    stamp: FrameStamp  # FrameStamp
    instance: int  # int
    world: WorldId  # WorldId
    T_WB: Pose  # the body in W
    up_W: npt.NDArray[np.float64]  # (3,), of length 1
    next_id: int  # int
    objects: List[ObjectBelief]  # list of ObjectBelief
    pose_error: npt.NDArray[np.float64]  # (6, 6), symmetric, of [θ, p]: what cross_pose refers to
    near_source: int  # int
    near_revision: int  # int
    near_m: float  # float
    ended: List[EndedTrack]  # list of EndedTrack
    as_estimated: List[ObjectBelief]  # list of ObjectBelief, the filter's own beliefs of objects that people corrected
    def __iter__(self) -> Iterator[ObjectBelief]: ...
    def __len__(self) -> int: ...
    def __getitem__(self, index: Any) -> ObjectBelief: ...
    @property
    def ids(self) -> npt.NDArray[np.uint64]: ...  # (N,) uint64.
    @property
    def existence(self) -> Array: ...  # (N,) probabilities.
    @property
    def mean(self) -> Array: ...  # (N, 7) of each object's most probable class.
    @property
    def covariance(self) -> Array: ...  # (N, 7, 7) of ``mean``.

class ObjectState(Message):
    stamp: FrameStamp  # FrameStamp
    instance: int  # int
    world: WorldId  # WorldId
    object: ObjectBelief  # ObjectBelief
    @property
    def id(self) -> int: ...  # The object's id, by which the topic is keyed.
    @id.setter
    def id(self, value: Any) -> None: ...

class Event(Message):
    stamp: FrameStamp  # FrameStamp
    instance: int  # int
    world: WorldId  # WorldId
    kind: Literal["born", "confirmed", "class_resolved", "occluded", "left_view", "reappeared", "merged", "archived", "recalled", "missing", "gone", "moved", "predicted_return", "model_changed", "restored", "loop_closed", "loop_withdrawn", "relocalised"]  # born | confirmed | class_resolved | occluded | left_view | reappeared | merged | archived | recalled | missing | gone | moved | predicted_return | model_changed | restored | loop_closed | loop_withdrawn | relocalised
    object_id: int  # int
    other_id: int  # int
    class_name: str  # str
    probability: float  # 0 to 1, what the event is about: existence, or that of the class
    detail: str  # str
    returns_in: float  # s after the stamp, of predicted_return
    returns_earliest: float  # s, 5 %
    returns_latest: float  # s, 95 %

class Prediction(Message):
    object_id: int  # int
    class_name: str  # str
    x1: float  # px
    y1: float  # px
    x2: float  # px
    y2: float  # px
    probability: float  # 0 to 1
    velocity_x1: float  # px/s
    velocity_y1: float  # px/s
    velocity_x2: float  # px/s
    velocity_y2: float  # px/s
    sigma_x1: float  # float
    sigma_y1: float  # float
    sigma_x2: float  # float
    sigma_y2: float  # float
    @property
    def box(self) -> Array: ...  # (4,) x1, y1, x2, y2, px of the distorted image; x right, y down.
    @box.setter
    def box(self, value: Any) -> None: ...

class Predictions(Message):
    stamp: FrameStamp  # FrameStamp
    instance: int  # int
    camera: str  # str
    predictions: List[Prediction]  # list of Prediction

class MapObject(Message):
    id: int  # int
    world: WorldId  # WorldId, M, the frame of the map, or the W that was asked for
    class_name: str  # not empty
    existence: float  # 0 to 1
    class_probability: float  # 0 to 1
    mean: npt.NDArray[np.float64]  # (7,), centre [m], yaw [rad], log of length, width, height [log m]
    covariance: npt.NDArray[np.float64]  # (7, 7), symmetric, positive definite, of mean
    first_seen_ns: int  # ns, sensor clock
    last_seen_ns: int  # ns, sensor clock
    hits: int  # int
    visibility: Literal["visible", "partial", "occluded", "out_of_view", "behind"]  # visible | partial | occluded | out_of_view | behind
    memory: Literal["working", "long_term"]  # working | long_term
    provisional: bool  # of a session that is not found on the map of before yet
    @property
    def position(self) -> Array: ...  # (3,) centre, m.
    @property
    def yaw(self) -> float: ...  # rad, about the vertical.
    @property
    def size(self) -> Array: ...  # (3,) length, width, height, m.

class MapTile(Message):
    x: int  # int
    y: int  # int
    part: int  # int
    instance: int  # int
    revision: int  # int
    objects: List[MapObject]  # list of MapObject

class MapHeader(Message):
    instance: int  # int
    revision: int  # int
    tile_size_m: float  # m
    tiles: int  # int
    objects: int  # int

class MapFrame(Message):
    stamp: FrameStamp  # FrameStamp
    instance: int  # int
    world: WorldId  # WorldId
    map: WorldId  # WorldId
    T_MW: Pose  # takes points of W to M
    covariance: npt.NDArray[np.float64]  # (4, 4), symmetric, of the body's [p, yaw] in M; all 0 where anchors > 1: not known
    revision: int  # int
    sessions: int  # int
    loops: int  # int
    anchors: int  # int

class Member(Message):
    track: int  # int
    object: int  # int

class Correction(Message):
    id: int  # int
    kind: Literal["not_there", "class", "same", "different"]  # not_there | class | same | different
    object: int  # int
    other: int  # int
    class_name: str  # str
    nats: float  # log-likelihood ratio; 0 in requests: the map store's default
    author: str  # str
    time_ns: int  # ns, sensor clock
    withdrawn: bool  # bool

class MapNear(Message):
    stamp: FrameStamp  # FrameStamp
    instance: int  # int
    client: int  # int
    world: WorldId  # WorldId
    revision: int  # int
    kept_ns: int  # ns, sensor clock
    next_id: int  # int
    corrects_drift: bool  # bool
    more: bool  # bool
    members: List[Member]  # list of Member
    placed: List[ObjectBelief]  # list of ObjectBelief
    as_published: List[ObjectBelief]  # list of ObjectBelief
    corrections: List[Correction]  # list of Correction

class MapQuery(Message):
    client: int  # int
    request: int  # int
    kind: Literal["by_id", "by_class", "by_radius", "by_box", "all", "restore", "recall", "graph"]  # by_id | by_class | by_radius | by_box | all | restore | recall | graph
    object_id: int  # int
    class_name: str  # str
    low: npt.NDArray[np.float64]  # (3,), m, corner, or centre of the sphere
    high: npt.NDArray[np.float64]  # (3,), m
    radius: float  # m
    world: WorldId  # WorldId
    limit: int  # int

class MapCorrection(Message):
    client: int  # int
    request: int  # int
    correction: Correction  # Correction

class MapAnchor(Message):
    id: int  # int
    previous: int  # of the same session; 0: none
    session: WorldId  # WorldId
    map: WorldId  # WorldId, M, the frame of p and yaw
    p: npt.NDArray[np.float64]  # (3,), m
    yaw: float  # rad
    sigma: npt.NDArray[np.float64]  # (4,), m and rad, of [p, yaw] relative to the first anchor of M
    objects: int  # int

class MapLoopPair(Message):
    known: int  # int
    seen: int  # int

class MapLoop(Message):
    id: int  # int
    a: int  # int
    b: int  # int
    kind: Literal["loop", "tie"]  # loop | tie
    state: Literal["tentative", "confirmed", "withdrawn"]  # tentative | confirmed | withdrawn
    residual: npt.NDArray[np.float64]  # (4,), m and rad, measured [p, yaw] of b minus where it lies, axes of a
    sigma: npt.NDArray[np.float64]  # (4,), m and rad, of the measurement
    chi2: float  # float
    weight: float  # 0 to 1
    pairs: List[MapLoopPair]  # list of MapLoopPair
    landmarks: int  # int

class MapReply(Message):
    client: int  # int
    request: int  # int
    instance: int  # int
    ok: bool  # bool
    error: str  # str
    truncated: bool  # bool
    objects: List[MapObject]  # list of MapObject
    beliefs: List[ObjectBelief]  # list of ObjectBelief
    anchors: List[MapAnchor]  # list of MapAnchor, of the graph, by id
    loops: List[MapLoop]  # list of MapLoop, between these
    anchor_count: int  # of the same M, those not told too
    loop_count: int  # of the same M, those not told too
    corrections: List[Correction]  # list of Correction

class Health(Message):
    process: str  # not empty
    instance: int  # int
    pid: int  # int
    state: Literal["starting", "ok", "degraded", "failed"]  # starting | ok | degraded | failed
    message: str  # what is wrong, and the fix
    frames_in: int  # int
    frames_out: int  # int
    dropped: int  # int
    rate_hz: float  # Hz, of frames_out
    cpu_s: float  # s, since the start
    rss_bytes: int  # int
    reasons: Dict[str, int]  # counts
