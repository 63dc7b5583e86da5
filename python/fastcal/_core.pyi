# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""
fastcal's core: robots, effects, identification. Everything is SI; twists are [v; w].
"""
from __future__ import annotations
import collections.abc
import numpy
import numpy.typing
import typing
__all__: list[str] = ['Alignment', 'ArmBending', 'ArmStructure', 'BeamSolver', 'BlockScores', 'Branch', 'Candidates', 'Choice', 'Compensator', 'Effect', 'ErrorModel', 'Field', 'FoldErrors', 'Identification', 'Linearization', 'Loop', 'Measurements', 'Member', 'Observation', 'ObservationEntry', 'Parameter', 'PoseSolver', 'Rig', 'RobotDescription', 'RobotModel', 'SHOWN_BY_LOADS', 'SHOWN_BY_MOTION', 'Samples', 'ScoreTests', 'Separation', 'StiffnessTable', 'StructureElement', 'StructureNode', 'SubsetSearch', 'Tracker', 'TwistMemory', 'align', 'build_dh', 'build_mdh', 'build_poe', 'build_urdf', 'choose_gauge', 'draw', 'draw_design', 'effect_names', 'effect_owners', 'effect_traits', 'exchange_design', 'exp_so3', 'free_parameters', 'grow_design', 'identify', 'instruction_set', 'inverse_kinematics', 'join', 'joint_jacobian', 'linearize', 'log_so3', 'make_effect', 'mass_matrix', 'observability_index', 'observation_entry', 'observation_names', 'on_branch', 'posture_obstacles', 'quaternion_to_rotation', 'read_urdf', 'read_urdf_tree', 'residuals', 'rotation_about', 'rotation_to_axis', 'rotation_to_rpy', 'rpy_to_rotation', 'separate', 'spread_points', 'start_unknowns', 'surrogate_inputs', 'tabulated_effect', 'visiting_order']
class Parameter:
    """
    A named number of a model, in SI.
    """
    def __repr__(self) -> str:
        ...
    @property
    def expected(self) -> float:
        """
        where a prior holds it
        """
    @property
    def lower(self) -> float:
        """
        what it can be at all
        """
    @property
    def name(self) -> str:
        ...
    @property
    def owner(self) -> str:
        ...
    @property
    def sigma(self) -> float:
        """
        a plausible size of its error
        """
    @property
    def unit(self) -> str:
        ...
    @property
    def upper(self) -> float:
        ...
class Compensator:
    """
    A spring on a joint; anchor and arm [m] in the joint's frame at joint position 0.
    """
    def __init__(self, *, joint: typing.SupportsInt | typing.SupportsIndex, anchor: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"], arm: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"], stiffness: typing.SupportsFloat | typing.SupportsIndex, free_length: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
class ArmBending:
    """
    How an arm's beams bend.
    """
    @property
    def frames(self) -> list[int]:
        """
        Frames of the chain that the beams move.
        """
    @property
    def groups(self) -> list[str]:
        """
        Names of the groups of elements.
        """
class Loop:
    """
    What closes a loop of an arm: equations between two frames or between joints; SI.
    """
    @staticmethod
    def gear(*, name: str, driven: typing.SupportsInt | typing.SupportsIndex, joints: collections.abc.Sequence[tuple[typing.SupportsInt | typing.SupportsIndex, typing.SupportsFloat | typing.SupportsIndex]], offset: typing.SupportsFloat | typing.SupportsIndex) -> Loop:
        """
        A joint turns by the sum of ratios times others' turns, and an offset [rad, m].
        """
    @staticmethod
    def pose(*, name: str, from_frame: typing.SupportsInt | typing.SupportsIndex, to_frame: typing.SupportsInt | typing.SupportsIndex, T_from_pin: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"], T_to_pin: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"], fixed: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], knows_from: bool, knows_to: bool) -> Loop:
        """
        Components (0 to 5: x y z rx ry rz) of the pose of one pin seen from another are 0; knows_from, knows_to: the pin's place is a parameter.
        """
    @staticmethod
    def rod(*, name: str, from_frame: typing.SupportsInt | typing.SupportsIndex, to_frame: typing.SupportsInt | typing.SupportsIndex, p_from: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"], p_to: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"], length: typing.SupportsFloat | typing.SupportsIndex, joints: collections.abc.Sequence[tuple[typing.SupportsInt | typing.SupportsIndex, typing.SupportsFloat | typing.SupportsIndex]] = []) -> Loop:
        """
        The distance [m] of two pins; joints (joint, m per m or rad) add to it.
        """
    @property
    def name(self) -> str:
        ...
class RobotDescription:
    """
    What every kind of robot file has beside its geometry; SI.
    """
    def __init__(self, *, joint_types: collections.abc.Sequence[str], mass: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], com: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"], inertia: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"], T_world_base: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"], T_flange_tool: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"], p_flange_payload: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"], gravity: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"], gravity_in_world: bool, coupling: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"], wrench_frame: str, compensator: Compensator | None = None, motor_ratio: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"] = ..., bending: ArmBending | None = None, parents: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex] = [], passive: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex] = [], loops: collections.abc.Sequence[Loop] = [], home: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"] = ...) -> None:
        """
        parents: of each joint the one on whose link it stands (-1: the base), empty: the one before; home (n,): where the loops nearly close. joint_types (n) 'revolute' or 'prismatic'; mass (n,), com (n, 3), inertia (n, 6) as xx yy zz xy xz yz; poses (4, 4); coupling (n, n).
        """
class Branch:
    """
    A run of frames, joints and parameters of a robot: an arm, or one frame alone.
    """
    def __repr__(self) -> str:
        ...
    @property
    def first_frame(self) -> int:
        ...
    @property
    def first_joint(self) -> int:
        ...
    @property
    def first_parameter(self) -> int:
        ...
    @property
    def frame_count(self) -> int:
        ...
    @property
    def joint_count(self) -> int:
        ...
    @property
    def name(self) -> str:
        """
        empty where it is the whole robot
        """
    @property
    def parameter_count(self) -> int:
        ...
    @property
    def parent(self) -> int:
        """
        the frame that its first one stands on; -1: the measuring frame
        """
class RobotModel:
    """
    A robot as a chain of elementary motions, or a tree; const.
    """
    def assemble(self, q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"], threads: typing.SupportsInt | typing.SupportsIndex = 1) -> tuple:
        """
        Joint positions (N, n) with the passive joints where the loops close; statuses (N,): 0 closed, 1 singular, 2 another way of assembly, 3 open; the widest gap (N,) [m, rad] and (N,) the loop that has it.
        """
    def base_and_tool(self, values: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> tuple[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"], typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]]:
        """
        T_world_base and T_flange_tool (4, 4) at parameter values (P,).
        """
    def frame(self, name: str) -> int:
        """
        The frame of this name; -1: 'world'.
        """
    def frame_name(self, frame: typing.SupportsInt | typing.SupportsIndex) -> str:
        ...
    def frame_origins(self, q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"]) -> numpy.typing.NDArray[numpy.float64]:
        """
        Origins (N, frames, 3) of the chain's frames in the measuring frame, at joint positions (N, n).
        """
    def placements(self, values: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> list[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]]:
        """
        Where each branch stands on its frame (4, 4), at parameter values (P,).
        """
    def with_base_and_tool(self, T_world_base: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"], T_flange_tool: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"]) -> RobotModel:
        """
        The same robot with base and tool (4, 4) there; their rx, ry, rz are measured from there.
        """
    @property
    def branches(self) -> list[Branch]:
        ...
    @property
    def frame_count(self) -> int:
        ...
    @property
    def home(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        A posture (n,) in which the loops close; empty without loops.
        """
    @property
    def joint_count(self) -> int:
        ...
    @property
    def nominal(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        Values of the parameters (P,), SI.
        """
    @property
    def parameters(self) -> list[Parameter]:
        ...
    @property
    def parents(self) -> list[int]:
        """
        Of each frame, in depth-first order; -1: the measuring frame.
        """
    @property
    def passive(self) -> list[int]:
        """
        Joints, from 0, that closed loops move and no motor.
        """
class Member:
    """
    What join() makes a branch of: a robot, or one frame, which has none.
    """
    def __init__(self, *, name: str, on: str = 'world', robot: RobotModel | None = None, T_on_frame: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"] = ..., sigma_position: typing.SupportsFloat | typing.SupportsIndex = 0.001, sigma_rotation: typing.SupportsFloat | typing.SupportsIndex = 0.001) -> None:
        ...
class Effect:
    """
    One physical cause of pose error, as small twists on frames of the chain.
    """
    @property
    def data_columns(self) -> list[str]:
        """
        Columns of the data that it cannot do without, beside q.
        """
    @property
    def follows_loads(self) -> bool:
        """
        Does it yield to loads?
        """
    @property
    def parameters(self) -> list[Parameter]:
        ...
    @property
    def penalty(self) -> list[float]:
        """
        Weights of a quadratic penalty on the parameters, one each; empty: none.
        """
    @property
    def reference(self) -> dict[str, tuple[str, list[float]]]:
        """
        Options by which the numbers keep their meaning on a robot whose geometry has moved: unit and SI values.
        """
class Field:
    """
    One table of a data set and the columns of a file that it is read from.
    """
    @property
    def columns(self) -> list[str]:
        """
        without their units
        """
    @property
    def each_link(self) -> bool:
        """
        one table a link: NAME@linkN
        """
    @property
    def name(self) -> str:
        ...
    @property
    def quantity(self) -> str:
        """
        length, angle ...; empty: plain numbers or labels
        """
    @property
    def role(self) -> str:
        """
        measured, sigma or label
        """
    @property
    def written_unit(self) -> str:
        ...
class ObservationEntry:
    """
    What the registry knows of a kind of observation.
    """
    @property
    def fields(self) -> list[Field]:
        ...
    @property
    def labelled(self) -> int:
        """
        numbers of a row that a label alone marks
        """
    @property
    def note(self) -> str:
        """
        for a reader of data that have it; may be empty
        """
    @property
    def plural(self) -> str:
        ...
class Rig:
    """
    Cameras and boards of a cell.
    """
    def __init__(self) -> None:
        ...
    def add_board(self, name: str, frame: typing.SupportsInt | typing.SupportsIndex, T_frame_board: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"], fixed: bool, corners: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"]) -> None:
        """
        corners: (K, 3) [m] in the board's frame.
        """
    def add_camera(self, name: str, frame: typing.SupportsInt | typing.SupportsIndex, T_frame_camera: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"], fixed: bool, lens: str, intrinsics: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], identified: bool) -> None:
        """
        `frame` of the chain, -1: the measuring frame.
        """
    def set_motion(self, name: str, xi: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"]) -> None:
        """
        (N, 6) twist [m/s, rad/s] of the frame of a camera or board in each row.
        """
    def set_shift(self, name: str, xi: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"]) -> None:
        """
        (N, 6) twist [m, rad] by which a camera or board is out of place in each row, in the axes of its frame.
        """
    def set_timing(self, camera: str, delay: typing.SupportsFloat | typing.SupportsIndex, line_time: typing.SupportsFloat | typing.SupportsIndex, middle_line: typing.SupportsFloat | typing.SupportsIndex) -> None:
        """
        delay [s] of its pictures behind the joints at v = middle_line [px], and line_time [s] from line to line.
        """
class Observation:
    """
    One observation of some measurements.
    """
    @property
    def claims_sigma(self) -> bool:
        ...
    @property
    def components(self) -> list[str]:
        """
        of its numbers in a row, reading by reading
        """
    @property
    def field(self) -> str:
        """
        of a data set, or empty
        """
    @property
    def first_number(self) -> int:
        """
        of its numbers in a row of residuals
        """
    @property
    def is_known(self) -> bool:
        """
        beforehand, and not read
        """
    @property
    def is_pose(self) -> bool:
        ...
    @property
    def name(self) -> str:
        ...
    @property
    def parameters(self) -> list[Parameter]:
        """
        its unknowns
        """
    @property
    def reading_count(self) -> int:
        """
        of a row
        """
    @property
    def unit(self) -> str:
        """
        m, rad or px
        """
class Measurements:
    """
    N rows of what was measured, SI; NaN: not in this row.
    """
    def __init__(self, robot: RobotModel, rows: typing.SupportsInt | typing.SupportsIndex, numbers: collections.abc.Mapping[str, typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"]], labels: collections.abc.Mapping[str, tuple[typing.Annotated[numpy.typing.ArrayLike, numpy.int32, "[m, 1]"], collections.abc.Sequence[str]]] = {}, rig: Rig | None = None) -> None:
        """
        From tables by the names of fields; labels are indices and their names.
        """
    def __len__(self) -> int:
        ...
    def sigma(self, row: typing.SupportsInt | typing.SupportsIndex, number: typing.SupportsInt | typing.SupportsIndex) -> float:
        """
        claimed standard deviation; 0: none
        """
    @property
    def number_count(self) -> int:
        ...
    @property
    def observations(self) -> list[Observation]:
        ...
    @property
    def parameters(self) -> list[Parameter]:
        """
        unknowns of all observations
        """
    @property
    def shows_base(self) -> bool:
        ...
    @property
    def shows_scale(self) -> bool:
        ...
    @property
    def shows_tool(self) -> bool:
        ...
    @property
    def shows_tool_turn(self) -> bool:
        ...
class Samples:
    """
    N rows of conditions, SI; what is None was not measured. Of a tree of a arms payload, temperature, station and mount are (N, a), wrench (N, 6 a).
    """
    @staticmethod
    def side_by_side(arms: collections.abc.Sequence[Samples]) -> Samples:
        """
        Postures of the arms of a tree, in its order, as the tree's; what an arm does not know is 0 of payloads, wrenches and approaches.
        """
    def __init__(self, q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], *, payload: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"] | None = None, wrench: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"] | None = None, temperature: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"] | None = None, time: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"] | None = None, station: typing.Annotated[numpy.typing.ArrayLike, numpy.int32, "[m, n]"] | None = None, mount: typing.Annotated[numpy.typing.ArrayLike, numpy.int32, "[m, n]"] | None = None, approach: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"] | None = None, current: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"] | None = None, extra: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"] | None = None, table: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"] | None = None) -> None:
        ...
    def __len__(self) -> int:
        ...
    def slice(self, begin: typing.SupportsInt | typing.SupportsIndex, end: typing.SupportsInt | typing.SupportsIndex) -> Samples:
        """
        Rows begin ... end - 1.
        """
class ErrorModel:
    """
    A robot with its effects.
    """
    def __init__(self, robot: RobotModel, effects: collections.abc.Sequence[Effect] = [], effect_values: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"] = ...) -> None:
        ...
    def loads(self, samples: Samples, theta: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], payload_alone: bool = False, threads: typing.SupportsInt | typing.SupportsIndex = 1) -> numpy.typing.NDArray[numpy.float64]:
        """
        Force and moment (N, frames + loops, 6) that all beyond a frame puts on it, in its axes, about its origin [N, N m]; joint i has frame 2 i - 1, z its axis. Behind the frames stand the loops, part 2 a rod's pull [N].
        """
    def parameter_jacobian(self, samples: Samples, theta: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], rows: typing.SupportsInt | typing.SupportsIndex = 3, threads: typing.SupportsInt | typing.SupportsIndex = 1, out: typing.Any = None, of: str = '') -> numpy.ndarray:
        """
        (N, rows, P): motion of the tool by every parameter, in the axes of the measuring frame; 3 rows: position, 6: [v; w]. `of`: as predict; motion as it is seen from the sensor, in its axes.
        """
    def predict(self, samples: Samples, theta: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], threads: typing.SupportsInt | typing.SupportsIndex = 1, out: typing.Any = None, of: str = '') -> numpy.ndarray:
        """
        Poses (N, 4, 4) of the tool in the measuring frame, or of what `of` names: 'TARGET', 'TARGET:SENSOR'.
        """
    def with_equilibrium(self, at_equilibrium: bool) -> ErrorModel:
        """
        The same model, loads in the deflected or the undeflected posture.
        """
    def with_robot(self, robot: RobotModel) -> ErrorModel:
        """
        The same effects on another robot of the same parameters.
        """
    @property
    def at_equilibrium(self) -> bool:
        """
        Are loads taken in the deflected posture?
        """
    @property
    def parameters(self) -> list[Parameter]:
        ...
    @property
    def robot(self) -> RobotModel:
        ...
    @property
    def start(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        Values of the parameters (P,), SI.
        """
class Alignment:
    """
    Best rigid fit of base and tool.
    """
    @property
    def T_flange_tool(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
        ...
    @property
    def T_world_base(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
        ...
    @property
    def found(self) -> bool:
        ...
    @property
    def message(self) -> str:
        ...
    @property
    def rms(self) -> float:
        """
        [m] what the rigid fit leaves
        """
    @property
    def unknowns(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        (U,) of the observations
        """
class Identification:
    """
    What identify() found; SI.
    """
    @property
    def asked(self) -> list[int]:
        """
        indices of the parameters in the rows of held_directions
        """
    @property
    def common_noise(self) -> list[float]:
        """
        standard deviation common to all rows, by observation
        """
    @property
    def covariance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        of the free ones
        """
    @property
    def covariance_root(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        lower triangular L with a positive diagonal, covariance = L L^T
        """
    @property
    def degrees_of_freedom(self) -> int:
        ...
    @property
    def free(self) -> list[int]:
        """
        indices that were identified
        """
    @property
    def held(self) -> list[int]:
        """
        indices that the gauge holds at nominal
        """
    @property
    def held_directions(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        (asked, held): how all move with a held one that is off by its plausible size; SI
        """
    @property
    def iterations(self) -> int:
        ...
    @property
    def loss(self) -> str:
        ...
    @property
    def message(self) -> str:
        ...
    @property
    def outliers(self) -> list[int]:
        """
        rows that the noise does not explain
        """
    @property
    def parameters(self) -> list[Parameter]:
        """
        of theta: the model's, then the observations' unknowns
        """
    @property
    def rank(self) -> int:
        ...
    @property
    def residuals(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        (N, numbers), NaN where not measured
        """
    @property
    def sigma(self) -> list[float]:
        """
        RMS standard deviation used, by observation
        """
    @property
    def status(self) -> str:
        ...
    @property
    def theta(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        ...
    @property
    def unidentifiable(self) -> list[str]:
        ...
    @property
    def unidentifiable_parts(self) -> list[list[int]]:
        ...
    @property
    def variance_factor(self) -> float:
        ...
    @property
    def weights(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        (N,) robust weight of each row
        """
class PoseSolver:
    """
    One pose at a time, made ready once; not for several threads at a time.
    """
    def __init__(self, model: ErrorModel, conditions: Samples, *, limits: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"], reach: typing.SupportsFloat | typing.SupportsIndex, tolerance_position: typing.SupportsFloat | typing.SupportsIndex, tolerance_rotation: typing.SupportsFloat | typing.SupportsIndex, restarts: typing.SupportsInt | typing.SupportsIndex, held: collections.abc.Sequence[bool], random_seed: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def forward(self, q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> numpy.typing.NDArray[numpy.float64]:
        """
        (4, 4) pose of the tool in the measuring frame at joint positions (n,).
        """
    def inverse(self, target: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], seed: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> tuple[numpy.typing.NDArray[numpy.float64], int, float, float]:
        """
        q (n,), status, distance left [m], angle left [rad] for one (4, 4).
        """
class BeamSolver:
    """
    Displacements of a frame of beams; fastcal.BeamFrame is its door.
    """
    def __init__(self, dimension: typing.SupportsInt | typing.SupportsIndex, node_count: typing.SupportsInt | typing.SupportsIndex, elements: collections.abc.Sequence[tuple[typing.SupportsInt | typing.SupportsIndex, typing.SupportsInt | typing.SupportsIndex]], sections: numpy.typing.NDArray[numpy.float64], sampled: collections.abc.Sequence[bool], hinges: collections.abc.Sequence[tuple[typing.SupportsInt | typing.SupportsIndex, typing.SupportsInt | typing.SupportsIndex, typing.SupportsInt | typing.SupportsIndex]], supports: collections.abc.Sequence[tuple[typing.SupportsInt | typing.SupportsIndex, typing.SupportsInt | typing.SupportsIndex]]) -> None:
        """
        `sections` (elements, 9): E, A, I_z, I_y, J, G, shear area y and z, mass. `hinges` (element, end, axes) and `supports` (node, directions) hold bits.
        """
    def solve(self, nodes: numpy.typing.NDArray[numpy.float64], load: numpy.typing.NDArray[numpy.float64] | None, gravity: numpy.typing.NDArray[numpy.float64], up: numpy.typing.NDArray[numpy.float64] | None, stiffness: numpy.typing.NDArray[numpy.float64] | None, scale: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], threads: typing.SupportsInt | typing.SupportsIndex, displacement: numpy.typing.NDArray[numpy.float64]) -> None:
        """
        Fills `displacement` (N, M, B) from `nodes` (N, M, D); the other arrays hold one row, or one a posture.
        """
    def solve_with_derivative(self, nodes: numpy.typing.NDArray[numpy.float64], load: numpy.typing.NDArray[numpy.float64] | None, gravity: numpy.typing.NDArray[numpy.float64], up: numpy.typing.NDArray[numpy.float64] | None, stiffness: numpy.typing.NDArray[numpy.float64] | None, scale: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], group: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], group_count: typing.SupportsInt | typing.SupportsIndex, threads: typing.SupportsInt | typing.SupportsIndex, displacement: numpy.typing.NDArray[numpy.float64], derivative: numpy.typing.NDArray[numpy.float64]) -> None:
        """
        Fills `derivative` (N, M, B, groups) too: by a factor on the stiffness of each group of elements.
        """
class StiffnessTable:
    """
    Stiffness of an element's end, K_ij = f_ij(extension) g_ij(angle), from samples.
    """
    def __init__(self, angle: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], extension: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], matrices: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"], angle_degree: typing.SupportsInt | typing.SupportsIndex, extension_degree: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    def evaluate(self, angle: typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"], extension: typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        Matrices (N, size * size) at N pairs of angle [rad] and extension [m].
        """
    @property
    def relative_error(self) -> float:
        ...
    @property
    def size(self) -> int:
        ...
class StructureNode:
    """
    A node of an arm's beams, tied to frames of the chain.
    """
    def __init__(self, *, name: str, origin: typing.SupportsInt | typing.SupportsIndex, frame: typing.SupportsInt | typing.SupportsIndex, position: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"], moves: typing.SupportsInt | typing.SupportsIndex, mass: typing.SupportsFloat | typing.SupportsIndex, links: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], carries_payload: bool, held: typing.SupportsInt | typing.SupportsIndex) -> None:
        """
        It stands at `position` (3,) [m] from the origin of frame `origin`, in the axes of `frame`, and moves the frame `moves` (-1: none); links count from 0; `held` holds bits of ux uy uz rx ry rz.
        """
class StructureElement:
    """
    An element of an arm's beams.
    """
    def __init__(self, *, name: str, start: typing.SupportsInt | typing.SupportsIndex, end: typing.SupportsInt | typing.SupportsIndex, section: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(8)"] | None, mass: typing.SupportsFloat | typing.SupportsIndex, hinges: typing.Annotated[collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], "FixedSize(2)"], group: typing.SupportsInt | typing.SupportsIndex, up_frame: typing.SupportsInt | typing.SupportsIndex, up: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"], stiffness: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[6, 6]"] | None, table: typing.SupportsInt | typing.SupportsIndex) -> None:
        """
        `section` (8,): E, A, I_z, I_y, J, G, shear area y and z; None where `stiffness` (6, 6) or a table gives the stiffness. `hinges`: bits of x y z at start and end.
        """
class ArmStructure(ArmBending):
    """
    The beams of an arm; fastcal.structure makes it from a robot file.
    """
    def __init__(self, nodes: collections.abc.Sequence[StructureNode], elements: collections.abc.Sequence[StructureElement], tables: collections.abc.Sequence[tuple[StiffnessTable, typing.SupportsInt | typing.SupportsIndex, typing.SupportsInt | typing.SupportsIndex]], groups: collections.abc.Sequence[str]) -> None:
        """
        `tables`: (StiffnessTable, joint that turns it, joint that extends it), joints from 0, -1: none.
        """
class FoldErrors:
    """
    Mean over the folds of the mean squared error held out, one a set.
    """
    @property
    def mean(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        ...
    @property
    def standard_error(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        of the mean, from the spread over the folds
        """
class SubsetSearch:
    """
    Cross-validated error of subsets of the columns of a least-squares problem.
    """
    def __init__(self, kept: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"], optional: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"], r: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], fold: typing.Annotated[numpy.typing.ArrayLike, numpy.int32, "[m, 1]"], *, least_norm: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> None:
        """
        kept (n, c) columns of every set, optional (n, m), r (n) with J b ~ r, fold (n) 0 ... K - 1 or, fitted always, -1.
        """
    def all(self) -> FoldErrors:
        """
        All 2^m sets; bit j of a set's index: optional column j is in it.
        """
    def of(self, sets: typing.Annotated[numpy.typing.ArrayLike, numpy.bool, "[m, n]"]) -> FoldErrors:
        """
        The sets of a boolean array (S, m).
        """
    @property
    def optional_count(self) -> int:
        ...
class Linearization:
    """
    The problem near a parameter vector; one row a measured number, whitened.
    """
    @property
    def J(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        (n, parameters and unknowns), SI
        """
    @property
    def number(self) -> typing.Annotated[numpy.typing.NDArray[numpy.int32], "[m, 1]"]:
        """
        (n) which number of its row
        """
    @property
    def r(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        (n) predicted less measured
        """
    @property
    def row(self) -> typing.Annotated[numpy.typing.NDArray[numpy.int32], "[m, 1]"]:
        """
        (n) row of the data
        """
class TwistMemory:
    """
    What the effects of one model make of one set of samples, kept from call to call.
    """
    def __init__(self) -> None:
        ...
class Candidates:
    """
    What could be measured: k rows of derivatives each, whitened and scaled.
    """
    def __init__(self, J: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"], rows: typing.SupportsInt | typing.SupportsIndex) -> None:
        """
        J (N rows, p)
        """
    def __len__(self) -> int:
        ...
    def information(self, chosen: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex]) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        sum J_c^T J_c (p, p) over those chosen
        """
class Choice:
    """
    A design and what it is worth.
    """
    @property
    def bound(self) -> float:
        """
        no choice of as many candidates, each once, is worth more
        """
    @property
    def members(self) -> list[int]:
        ...
    @property
    def value(self) -> float:
        """
        log det M, minus the variance, or the index
        """
class Tracker:
    """
    An instrument that looks at the tool; SI, measuring frame.
    """
    def __init__(self, position: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"], nearest: typing.SupportsFloat | typing.SupportsIndex, farthest: typing.SupportsFloat | typing.SupportsIndex, reflector: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"], acceptance: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
class Separation:
    """
    Candidates that separate causes of error.
    """
    @property
    def after(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        the same with the chosen candidates
        """
    @property
    def before(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        (m, m) D_ij: what is left of cause i where cause j is fitted, of the data measured already
        """
    @property
    def chosen(self) -> list[int]:
        """
        in the order in which they were added
        """
class BlockScores:
    """
    Rank and score statistic, one a block.
    """
    @property
    def rank(self) -> typing.Annotated[numpy.typing.NDArray[numpy.int32], "[m, 1]"]:
        """
        directions that the fitted parameters do not absorb
        """
    @property
    def statistic(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        chi square of that rank where the block is not missing
        """
class ScoreTests:
    """
    Score tests of blocks of columns that a least-squares fit lacks.
    """
    @staticmethod
    def projected(R: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"], r: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], length: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], null_rank: typing.SupportsInt | typing.SupportsIndex, sizes: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex]) -> ScoreTests:
        """
        The same from what A leaves: R (k, c) of C with columns of length 1, r (k), and the lengths (c) of C.
        """
    def __init__(self, A: typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]", "flags.f_contiguous"], C: typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]", "flags.f_contiguous"], r: typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"], sizes: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], least: typing.SupportsFloat | typing.SupportsIndex = 0.003) -> None:
        """
        A (m, p) whitened Jacobian of the fit, C (m, c) columns of the blocks, r (m) whitened, J dtheta ~ r; sizes: columns of each block.
        """
    def correlation(self, of: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], with_: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex]) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        (of, with_) largest canonical correlations.
        """
    def detectable(self, columns: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], limits: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], power: typing.SupportsFloat | typing.SupportsIndex = 0.8, draws: typing.SupportsInt | typing.SupportsIndex = 256, seed: typing.SupportsInt | typing.SupportsIndex = 0, threads: typing.SupportsInt | typing.SupportsIndex = 1) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        Root of the noncentrality at which each column alone lets some block pass its limit.
        """
    def given(self, added: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex]) -> BlockScores:
        """
        Scores of all once the blocks `added` are in.
        """
    def remaining_with(self, added: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex]) -> tuple[float, int]:
        """
        |r|^2 that A and the blocks `added` leave, and the rank of these.
        """
    def shared(self, of: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], with_: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex]) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        (of, with_) share of a block's fitted signature that another block explains as well.
        """
    @property
    def deviation(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        (c) its standard deviation for noise 1
        """
    @property
    def estimate(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        (c) of each block when it alone is added
        """
    @property
    def length(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        (c) of each column, that A does not absorb
        """
    @property
    def null_rank(self) -> int:
        ...
    @property
    def remaining(self) -> float:
        """
        |r|^2 of what A leaves
        """
    @property
    def scores(self) -> BlockScores:
        ...
    @property
    def surviving(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        (blocks) share of a column's length that A leaves
        """
def align(model: ErrorModel, samples: Samples, measured: Measurements, threads: typing.SupportsInt | typing.SupportsIndex = 1) -> Alignment:
    """
    Closed-form base and tool and unknowns of the observations, refined; no initial guess is needed.
    """
def build_dh(description: RobotDescription, rows: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"], flange: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"] = ...) -> RobotModel:
    """
    Classic DH; rows (n, 5): theta, d, a, alpha, beta in rad and m; flange (4, 4) in the last row's frame.
    """
def build_mdh(description: RobotDescription, rows: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"], flange: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"] = ...) -> RobotModel:
    """
    Modified DH (Craig); row i holds alpha_(i-1), a_(i-1); columns and flange as build_dh.
    """
def build_poe(description: RobotDescription, screws: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"], home: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"]) -> RobotModel:
    """
    Products of exponentials; screws (n, 7): omega, v, offset in the base frame; home (4, 4).
    """
def build_urdf(description: RobotDescription, origins: collections.abc.Sequence[typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"]], axes: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"], flange: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"]) -> RobotModel:
    """
    URDF chain; origins n of (4, 4), axes (n, 3), flange (4, 4).
    """
def choose_gauge(R: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"], hold: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], relative_tolerance: typing.SupportsFloat | typing.SupportsIndex) -> tuple[list[int], typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"], typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]]:
    """
    (held, directions (p, held), singular values): what a triangular factor R (p, p) does not fix to relative_tolerance of its largest singular value; of the columns that could be held those of large `hold`.
    """
def draw(lens: str, intrinsics: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], points: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"]) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
    """
    (K, 2) [px] of points (K, 3) [m] in a camera's frame; intrinsics fx fy cx cy and the lens' coefficients.
    """
def draw_design(candidates: typing.SupportsInt | typing.SupportsIndex, count: typing.SupportsInt | typing.SupportsIndex, seed: typing.SupportsInt | typing.SupportsIndex) -> list[int]:
    """
    count of so many candidates without replacement, the same on every machine.
    """
def effect_names() -> list[str]:
    """
    Names of all registered effects, sorted.
    """
def effect_owners(name: str, robot: RobotModel) -> list[str]:
    """
    All owners that a robot has for an effect.
    """
def effect_traits(name: str) -> dict:
    """
    What an effect states about itself, by the names of fastcal.effects.traits.Traits.
    """
def exchange_design(candidates: Candidates, criterion: str, *, start: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"], targets: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"], members: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], rounds: typing.SupportsInt | typing.SupportsIndex = 20, threads: typing.SupportsInt | typing.SupportsIndex = 1) -> Choice:
    """
    Exchanges members while that improves O1 ... O5 or the variance.
    """
def exp_so3(w: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
    """
    Rotation (3, 3) of the rotation vector w (3,) in rad.
    """
def free_parameters(R: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"], parameters: collections.abc.Sequence[Parameter]) -> tuple[list[int], list[str]]:
    """
    (indices, sentences): what data with the triangular factor R, whitened and scaled, can determine, and what they cannot.
    """
def grow_design(candidates: Candidates, criterion: str, count: typing.SupportsInt | typing.SupportsIndex, *, start: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"], targets: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"] = ..., threads: typing.SupportsInt | typing.SupportsIndex = 1) -> list[int]:
    """
    Members one after the other, by O1, or by variance = tr(M^-1 targets), M = start + the members' information.
    """
def identify(model: ErrorModel, samples: Samples, measured: Measurements, *, asked: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], unknowns: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"] = ..., method: str = 'nls', loss: str = 'tukey', prior_mean: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"] = ..., prior_sigma: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"] = ..., lower: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"] = ..., upper: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"] = ..., pull_mean: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"] = ..., pull_sigma: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"] = ..., max_iterations: typing.SupportsInt | typing.SupportsIndex = 100, practical_limit: typing.SupportsFloat | typing.SupportsIndex = 10.0, noise: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex] = [], gauge: bool = True, threads: typing.SupportsInt | typing.SupportsIndex = 1, rows: typing.Any = None) -> Identification:
    """
    Identifies the parameters `asked` (indices) and all unknowns of the observations, from the model's start.
    
    With `rows`, samples and measured are some of them: it has a length, and read(begin, end) and pick(rows) return Samples and Measurements of the same kinds. Residuals and weights are those of samples and measured.
    """
def instruction_set() -> str:
    """
    The instruction set that kernels run on: baseline, avx2, avx512 or neon; FASTCAL_ISA chooses it.
    """
def inverse_kinematics(model: ErrorModel, samples: Samples, targets: typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]", "flags.c_contiguous"], *, limits: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"], reach: typing.SupportsFloat | typing.SupportsIndex, tolerance_position: typing.SupportsFloat | typing.SupportsIndex, tolerance_rotation: typing.SupportsFloat | typing.SupportsIndex, restarts: typing.SupportsInt | typing.SupportsIndex, held: collections.abc.Sequence[bool], along_path: bool, random_seed: typing.SupportsInt | typing.SupportsIndex, threads: typing.SupportsInt | typing.SupportsIndex) -> tuple[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"], numpy.typing.NDArray[numpy.int32], typing.Annotated[numpy.typing.NDArray[numpy.int32], "[m, 1]"], typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"], typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]]:
    """
    q (N, n), status (N), evaluations (N), distance left (N) [m], angle left (N) [rad] for targets (N, 16); the q of samples is where the search begins.
    """
def join(members: collections.abc.Sequence[Member]) -> RobotModel:
    """
    The members as one tree of frames in depth-first order. Frames and owners of a robot's parameters become 'NAME.joint3', those of one frame 'NAME'; gravity is that of the first robot on the world.
    """
def joint_jacobian(model: ErrorModel, samples: Samples, threads: typing.SupportsInt | typing.SupportsIndex = 1) -> numpy.ndarray:
    """
    (N, 6, n): motion of the tool [v; w] by every joint, in the axes of the measuring frame.
    """
def linearize(model: ErrorModel, samples: Samples, measured: Measurements, theta: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], common_noise: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], threads: typing.SupportsInt | typing.SupportsIndex = 1, memory: TwistMemory | None = None, columns: bool = True) -> Linearization:
    """
    Whitened residuals and, with `columns`, their Jacobian at theta (model parameters and unknowns).
    """
def log_so3(R: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 3]"]) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
    """
    Rotation vector (3,) in rad of a rotation (3, 3), of length 0 to pi.
    """
def make_effect(name: str, robot: RobotModel, owner: str, options: collections.abc.Mapping[str, typing.SupportsFloat | typing.SupportsIndex | str | collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex]] = {}) -> Effect:
    """
    The effect of one owner; InvalidInput names what is wrong.
    """
def mass_matrix(robot: RobotModel, q: typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]", "flags.c_contiguous"]) -> numpy.ndarray:
    """
    (N, n, n) of the links, at joint positions (N, n) [kg m^2, kg m, kg].
    """
def observability_index(index: str, eigenvalues: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], poses: typing.SupportsInt | typing.SupportsIndex) -> float:
    """
    Of J^T J, eigenvalues ascending.
    """
def observation_entry(name: str) -> ObservationEntry:
    ...
def observation_names() -> list[str]:
    """
    Names of all kinds of observation, sorted.
    """
def on_branch(effect: Effect, tree: RobotModel, name: str, arm: RobotModel, extra: typing.SupportsInt | typing.SupportsIndex = 0, table: typing.SupportsInt | typing.SupportsIndex = 0) -> Effect:
    """
    An effect made for an arm alone, on the arm of this name in a cell; InvalidInput where it cannot be. `extra`, `table`: columns of these samples that are of the arms before it.
    """
def posture_obstacles(robot: RobotModel, q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"], *, keep_out: collections.abc.Sequence[tuple[typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"], typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]]], region: tuple[typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"], typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]] | None = None, tracker: Tracker | None = None, link_radius: typing.SupportsFloat | typing.SupportsIndex = 0.0, threads: typing.SupportsInt | typing.SupportsIndex = 1) -> list[int]:
    """
    Why each posture (N, n) cannot be measured: 0 it can, 1 keep-out, 2 region, 3 range, 4 acceptance, 5 sight.
    """
def quaternion_to_rotation(wxyz: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 1]"]) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
    """
    Rotation (3, 3) of a quaternion w, x, y, z, brought to length 1.
    """
def read_urdf(xml_text: str, base_link: str = '', tip_link: str = '') -> dict:
    """
    The chain from base_link to tip_link of a URDF, as a dict of SI numbers; InvalidInput where it is none.
    """
def read_urdf_tree(xml_text: str, base_link: str, tip_links: collections.abc.Sequence[str]) -> list:
    """
    The chains from base_link to several tips: pairs of the chain that each begins at the end of (-1: at the base) and what read_urdf gives. Shared joints are those of one chain, which ends where the ways part.
    """
def residuals(model: ErrorModel, samples: Samples, measured: Measurements, theta: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], threads: typing.SupportsInt | typing.SupportsIndex = 1) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
    """
    (N, numbers) predicted less measured at theta, model parameters and unknowns; NaN where not measured or unknown.
    """
def rotation_about(axis: str, angle: typing.SupportsFloat | typing.SupportsIndex) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
    """
    Rotation (3, 3) by an angle in rad about the axis 'x', 'y' or 'z'.
    """
def rotation_to_axis(axis: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
    """
    A rotation (3, 3) whose z axis is `axis` (unit).
    """
def rotation_to_rpy(R: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 3]"]) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
    """
    Roll, pitch, yaw in rad of a rotation (3, 3); roll is 0 at pitch = +-90 degrees.
    """
def rpy_to_rotation(rpy: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
    """
    Fixed-axis XYZ angles (3,) in rad to R = Rz(yaw) Ry(pitch) Rx(roll), (3, 3), as URDF.
    """
def separate(common: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"], causes: collections.abc.Sequence[typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"]], expected: collections.abc.Sequence[typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"]], count: typing.SupportsInt | typing.SupportsIndex, *, rows: typing.SupportsInt | typing.SupportsIndex = 3, prior: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"] | None = None, enough: typing.SupportsFloat | typing.SupportsIndex = ..., threads: typing.SupportsInt | typing.SupportsIndex = 1) -> Separation:
    """
    T-optimal choice: common (N rows, p) and causes (N rows, c_i) whitened columns, expected (c_i, e_i) how much of each there may be.
    """
def spread_points(x: typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]", "flags.f_contiguous"], first: typing.SupportsInt | typing.SupportsIndex, most: typing.SupportsInt | typing.SupportsIndex, apart: typing.SupportsFloat | typing.SupportsIndex) -> list[int]:
    """
    Rows of x (N, d): `first` and then, each time, the one that is farthest from all chosen before; at most `most`, none nearer than `apart` to another.
    """
def start_unknowns(model: ErrorModel, samples: Samples, measured: Measurements) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
    """
    (U,) unknowns of the observations in closed form, for a robot or tree that is where the model puts it.
    """
def surrogate_inputs(model: ErrorModel, samples: Samples, theta: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], names: str, threads: typing.SupportsInt | typing.SupportsIndex = 1) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
    """
    (N, inputs) what surrogates may depend on, such as "q2 load3", in the rows of the samples, SI.
    """
def tabulated_effect(robot: RobotModel, owner: str, parameters: collections.abc.Sequence[tuple[str, str, typing.SupportsFloat | typing.SupportsIndex, str]], frames: collections.abc.Sequence[str], first: typing.SupportsInt | typing.SupportsIndex, follows_loads: bool = False) -> Effect:
    """
    An effect whose basis stands in Samples.table from column `first` on, (frame, parameter, 6); parameters: (name, unit, sigma, doc).
    """
def visiting_order(q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"], from_: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> list[int]:
    """
    A short path through the rows (N, n), joints scaled, that begins near from_ (n).
    """
SHOWN_BY_LOADS: str = 'a load about it that varies in another way than the geometry: other poses, payloads or pulling sideways'
SHOWN_BY_MOTION: str = 'poses in which {owner} moves further'
__version__: str = '0.2.0'
