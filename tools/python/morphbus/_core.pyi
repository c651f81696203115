"""Types of the package's compiled part."""
from enum import Enum
from typing import Any, Optional, Sequence

import numpy
from numpy.typing import NDArray

Array = NDArray[numpy.float64]

class Failure(RuntimeError): ...

class TextError(Failure):
    diagnostics: list[Diagnostic]

class TextRange:
    file: str
    line: int
    column: int
    end_line: int
    end_column: int

class DiagnosticNote:
    where: TextRange
    message: str

class Diagnostic:
    is_error: bool
    where: TextRange
    message: str
    hint: str
    notes: list[DiagnosticNote]

class ModuleType:
    name: str
    links: list[str]
    joints: list[str]
    connectors: list[str]
    sensors: list[str]

class ConnectionOption:
    number: int
    connector_a: str
    connector_b: str
    X_AB: Array

class ConnectionType:
    name: str
    type_a: str
    type_b: str
    options: list[ConnectionOption]

class Model:
    hash: int
    module_types: list[ModuleType]
    connection_types: list[ConnectionType]
    robots: list[str]
    def __init__(self, path: str) -> None: ...
    @staticmethod
    def from_text(text: str, name: str = ...) -> Model: ...
    @staticmethod
    def from_bytes(bytes: bytes) -> Model: ...
    def __bytes__(self) -> bytes: ...
    def robot(self, name: str = ...) -> Robot: ...

class JointType(Enum):
    revolute = ...
    continuous = ...
    prismatic = ...
    fixed = ...

class Module:
    name: str
    type: str

class Link:
    name: str
    module: int
    mass_kg: float

class Joint:
    name: str
    module: int
    type: JointType
    link_a: int
    link_b: int
    lower: float
    upper: float
    effort: float
    speed: float
    start: float

class Connection:
    module_a: int
    module_b: int
    connector_a: str
    connector_b: str
    connection: str
    number: int

class LinkPoses:
    position: Array
    rotation: Array
    matrix: Array
    closure_m: float
    closure_rad: float

class KinematicGraph:
    class Edge:
        joint: int
        body_a: int
        body_b: int
        axis_R: list[float]
        point_R: list[float]
        locked: Optional[bool]
    bodies: list[list[int]]
    joints: list[KinematicGraph.Edge]
    mobility: Optional[int]

class Congruence:
    class JointImage:
        from_: int
        to: int
        sign: int
        offset: float
    decided: bool
    congruent: bool
    ways: int
    complete: bool
    reason: str
    keeps_frame: bool
    modules: list[int]
    joints: list[Congruence.JointImage]
    masses_equal: bool
    hulls_equal: bool
    def __bool__(self) -> bool: ...

class Robot:
    name: str
    model: Model
    modules: list[Module]
    links: list[Link]
    joints: list[Joint]
    connections: list[Connection]
    def find_link(self, name: str) -> int: ...
    def find_joint(self, name: str) -> int: ...
    def start_values(self) -> Array: ...
    def fk(self, q: Optional[Sequence[float]] = ...) -> LinkPoses: ...
    def jacobian(self, link: str, q: Optional[Sequence[float]] = ...) -> Array: ...
    def graph(self) -> KinematicGraph: ...
    def congruence_hash(self) -> int: ...
    def compare(self, other: Robot) -> Congruence: ...
    def variants(self, most: int = ..., seed: Optional[int] = ...) -> list[Robot]: ...
    def draw(self, views: Sequence[str] = ..., q: Optional[Sequence[float]] = ...) -> str: ...
    def _repr_svg_(self) -> str: ...

class Parameter:
    name: str
    is_int: bool
    value: float
    source_value: float
    least: float
    most: float

class Role:
    name: str
    extends: str
    is_abstract: bool

class Program:
    image: bytes
    hash: int
    roles: list[Role]
    parameters: list[Parameter]
    def __init__(self, path: str, model: Model) -> None: ...
    @staticmethod
    def from_text(text: str, model: Model, name: str = ...) -> Program: ...
    @staticmethod
    def from_image(image: bytes) -> Program: ...
    def with_parameter(self, name: str, value: float) -> Program: ...
    def disassemble(self) -> str: ...

class JointSeries:
    joint: str
    time_s: Array
    position: Array
    velocity: Array
    effort: Array
    command_time_s: Array
    target: Array

class PoseSeries:
    link: str
    time_s: Array
    position: Array
    rotation: Array

class RolePlayed:
    begin_s: float
    end_s: float
    role: str
    labels: list[tuple[str, str]]

class Log:
    run: str
    hash: str
    seconds: float
    tick_s: float
    whole: bool
    robot: Robot
    modules: list[str]
    def __init__(self, path: str, run: str = ...) -> None: ...
    def info_json(self) -> str: ...
    def roles(self, module: str) -> list[RolePlayed]: ...
    def joint(self, name: str) -> JointSeries: ...
    def joints_labelled(self, role: str, label: str) -> list[JointSeries]: ...
    def pose(self, link: str) -> PoseSeries: ...
    def believed_pose(self, link: str) -> PoseSeries: ...
    def draw(self, at_s: float, views: Sequence[str] = ...) -> str: ...
    def draw_strip(self, count: int = ..., from_s: float = ..., to_s: Optional[float] = ..., views: Sequence[str] = ...) -> str: ...
    def draw_video(self, fps: int = ..., from_s: float = ..., to_s: Optional[float] = ..., views: Sequence[str] = ...) -> bytes: ...
    def report_html(self) -> str: ...

class Verdict(Enum):
    equivalent = ...
    different = ...
    unusable = ...

class Alignment(Enum):
    tick = ...
    event = ...
    lag = ...

class ComparedItem:
    quantity: str
    role: str
    label: str
    module_a: str
    module_b: str
    unit: str
    samples: int
    max: float
    rms: float
    tolerance: float
    max_time_s: float
    first_over_s: float
    differs: bool

class Comparison:
    verdict: Verdict
    reason: str
    items: list[ComparedItem]
    first: int
    notes: list[str]
    text: str
    json: str

class Observation:
    tick: int
    time_s: float
    position: Array
    velocity: Array
    effort: Array
    link_position: Array
    link_rotation: Array
    sensors: list[list[float]]
    roles: list[str]

class RunResult:
    hash: str
    ticks: int
    reason: str
    error: str
    log: str

class Run:
    over: bool
    def __init__(self, robot: Robot, program: Program, *, seconds: float = ..., log: str = ..., name: str = ...,
                 settings: Sequence[tuple[str, str]] = ..., world: str = ..., friction: float = ..., ground: bool = ..., still: bool = ...,
                 loss: float = ..., seed: int = ..., random_seed: int = ..., noise_seed: int = ...) -> None: ...
    def step(self, ticks: int = ...) -> None: ...
    def observe(self) -> Observation: ...
    def command(self, text: str) -> None: ...
    def set(self, parameter: str, value: float) -> None: ...
    def drive(self, joint: int, target: float, speed: float = ...) -> None: ...
    def release(self, joint: int) -> None: ...
    def close(self) -> RunResult: ...
    def summary_json(self) -> str: ...
    def __enter__(self) -> Run: ...
    def __exit__(self, *what: Any) -> None: ...

class Batch:
    runs: list[Run]
    over: bool
    def __init__(self, runs: Sequence[Run], threads: int = ...) -> None: ...
    def __len__(self) -> int: ...
    def step(self, ticks: int = ...) -> None: ...
    def observe(self) -> list[Observation]: ...
    def close(self) -> list[RunResult]: ...

def compare(a: Log, b: Log, alignment: Alignment = ..., gait: bool = ..., tolerances: Sequence[tuple[str, str]] = ...) -> Comparison: ...
def check(path: str) -> list[Diagnostic]: ...
def format_m3l(text: str) -> str: ...
def format_dynarole(text: str) -> str: ...
def arithmetic_fingerprint() -> str: ...
