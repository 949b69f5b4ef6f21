"""Types and docstrings of octosurf, written by bindings/python/stubs/make_stub.py."""

import os
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Dict, List, Optional, Tuple, Union, overload

import numpy as np
import numpy.typing as npt

__version__: str

class Error(Exception):
    """What failed, where, and how to mend it; str() is one line "where: what; mend".

    kind: "usage" (the caller asked for something that makes no sense), "data" (a file, an image, a cloud or a pose is
    missing, damaged or foreign), "output" (a result could not be written) or "incomplete" (a scan that failed is
    not taken back yet, for want of memory: the Mapper's next call does that).
    where: a file, a parameter or a scan.
    mend: what to do about it; may be empty.

    When memory runs out, MemoryError is raised instead.
    """
    kind: str
    where: str
    mend: str

class Alignment:
    """A scan's pose against the surfaces of a map.

    Twists are (6,): three rotations (rad), then three translations (m), map axes, about the sensor's position.
    """
    @property
    def T_map_sensor(self) -> npt.NDArray[np.float64]:
        """(4, 4) float64, sensor frame to map frame; a copy."""
    def __repr__(self) -> str: ...
    @property
    def covariance(self) -> npt.NDArray[np.float64]:
        """(6, 6) float64, of the pose's error as a twist, as far as scan and map tell; a view."""
    @property
    def determined(self) -> int:
        """Directions that surfaces fix to within half a voxel."""
    def determined_length_m(self, twist: npt.ArrayLike) -> float:
        """m: how long a motion's part along the determined directions is."""
    @property
    def directions(self) -> npt.NDArray[np.float64]:
        """(6, 6) float64, orthonormal columns; surfaces fix the first `determined` of them; a view."""
    @property
    def disagreement(self) -> npt.NDArray[np.float64]:
        """(6,) float64, twist by which given pose and map disagree; a view."""
    @property
    def explained(self) -> int:
        """Of those, on the surface at this pose."""
    def explained_share(self) -> float:
        """In [0, 1]."""
    @property
    def innovation_m(self) -> float:
        """m: how far the scan lies from where those before it let expect it; over a voxel: a loop closes."""
    @property
    def known(self) -> int:
        """Of them, near surfaces that the map has."""
    @property
    def lever_m(self) -> float:
        """m: rotations count by it in `directions`."""
    @property
    def outcome(self) -> str:
        """"off", "nothing_known", "agrees", "corrected", "recovered", "set_aside" or "unexplained"."""
    @property
    def samples(self) -> int:
        """Of the scan's points that were looked at."""
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, as JSON can hold them."""

class AlignmentParameters:
    """A scan's pose against the map, before it is inserted."""
    def __eq__(self, other: object) -> bool: ...
    def __init__(self, *, enabled: bool = ...) -> None: ...
    def __repr__(self) -> str: ...
    @property
    def enabled(self) -> bool:
        """A pose is corrected where scan and map say significantly so; off: taken as given."""
    @enabled.setter
    def enabled(self, value: bool) -> None: ...
    @staticmethod
    def from_dict(values: Dict[str, Any]) -> AlignmentParameters:
        """Back from to_dict(); what is missing keeps its default. Throws Error(usage) for a name that is no field."""
    def replaced(self, *, enabled: bool = ...) -> AlignmentParameters:
        """A copy with the fields set that are given, by name as to the constructor."""
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, nested where they are settings themselves; as JSON can hold them."""

class Biped:
    """A robot on two legs, of a man's size; step limits are those of the foot put down.

    They are seen from the standing foot: its reference point in the standing foot's heading, level.
    """
    def __eq__(self, other: object) -> bool: ...
    def __init__(self, *, body: Union[BodyBox, Mapping[str, Any]] = ..., contact: Union[ContactLimits, Mapping[str, Any]] = ..., costs: Union[StepCosts, Mapping[str, Any]] = ..., foot: Union[ContactShape, Mapping[str, Any]] = ..., high_lift_m: float = ..., lift_m: float = ..., max_backward_m: float = ..., max_down_m: float = ..., max_forward_m: float = ..., max_turn_rad: float = ..., max_up_m: float = ..., max_width_m: float = ..., min_width_m: float = ..., stance_width_m: float = ...) -> None: ...
    def __repr__(self) -> str: ...
    @property
    def body(self) -> BodyBox:
        """BodyBox."""
    @body.setter
    def body(self, value: BodyBox) -> None: ...
    @property
    def contact(self) -> ContactLimits:
        """ContactLimits; `contact.up` tells which way is up."""
    @contact.setter
    def contact(self, value: ContactLimits) -> None: ...
    @property
    def costs(self) -> StepCosts:
        """StepCosts."""
    @costs.setter
    def costs(self, value: StepCosts) -> None: ...
    @property
    def foot(self) -> ContactShape:
        """ContactShape."""
    @foot.setter
    def foot(self, value: ContactShape) -> None: ...
    @staticmethod
    def from_dict(values: Dict[str, Any]) -> Biped:
        """Back from to_dict(); what is missing keeps its default. Throws Error(usage) for a name that is no field."""
    @property
    def high_lift_m(self) -> float:
        """m, where it would touch something so."""
    @high_lift_m.setter
    def high_lift_m(self, value: float) -> None: ...
    @property
    def lift_m(self) -> float:
        """m of the swinging foot over the higher of the two footholds beside it."""
    @lift_m.setter
    def lift_m(self, value: float) -> None: ...
    @staticmethod
    def limits() -> ContactLimits:
        """The ContactLimits it has unless told otherwise."""
    @property
    def max_backward_m(self) -> float:
        """m, of a step."""
    @max_backward_m.setter
    def max_backward_m(self, value: float) -> None: ...
    @property
    def max_down_m(self) -> float:
        """m, of a step."""
    @max_down_m.setter
    def max_down_m(self, value: float) -> None: ...
    @property
    def max_forward_m(self) -> float:
        """m, of a step."""
    @max_forward_m.setter
    def max_forward_m(self, value: float) -> None: ...
    @property
    def max_turn_rad(self) -> float:
        """rad, of a step."""
    @max_turn_rad.setter
    def max_turn_rad(self, value: float) -> None: ...
    @property
    def max_up_m(self) -> float:
        """m, of a step."""
    @max_up_m.setter
    def max_up_m(self, value: float) -> None: ...
    @property
    def max_width_m(self) -> float:
        """m, likewise."""
    @max_width_m.setter
    def max_width_m(self, value: float) -> None: ...
    @property
    def min_width_m(self) -> float:
        """m between the feet's reference points, sideways."""
    @min_width_m.setter
    def min_width_m(self, value: float) -> None: ...
    def replaced(self, *, body: Union[BodyBox, Mapping[str, Any]] = ..., contact: Union[ContactLimits, Mapping[str, Any]] = ..., costs: Union[StepCosts, Mapping[str, Any]] = ..., foot: Union[ContactShape, Mapping[str, Any]] = ..., high_lift_m: float = ..., lift_m: float = ..., max_backward_m: float = ..., max_down_m: float = ..., max_forward_m: float = ..., max_turn_rad: float = ..., max_up_m: float = ..., max_width_m: float = ..., min_width_m: float = ..., stance_width_m: float = ...) -> Biped:
        """A copy with the fields set that are given, by name as to the constructor."""
    @property
    def stance_width_m(self) -> float:
        """m between its feet when it stands."""
    @stance_width_m.setter
    def stance_width_m(self, value: float) -> None: ...
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, nested where they are settings themselves; as JSON can hold them."""
    def validate(self) -> None:
        """Throws Error(usage) naming field, value and rule."""

class BodyBox:
    """The upright box about a robot's trunk that nothing may stand in, m."""
    def __eq__(self, other: object) -> bool: ...
    def __init__(self, *, from_m: float = ..., length_m: float = ..., to_m: float = ..., width_m: float = ...) -> None: ...
    def __repr__(self) -> str: ...
    @staticmethod
    def from_dict(values: Dict[str, Any]) -> BodyBox:
        """Back from to_dict(); what is missing keeps its default. Throws Error(usage) for a name that is no field."""
    @property
    def from_m(self) -> float:
        """m above the ground under it."""
    @from_m.setter
    def from_m(self, value: float) -> None: ...
    @property
    def length_m(self) -> float:
        """m along its heading."""
    @length_m.setter
    def length_m(self, value: float) -> None: ...
    def replaced(self, *, from_m: float = ..., length_m: float = ..., to_m: float = ..., width_m: float = ...) -> BodyBox:
        """A copy with the fields set that are given, by name as to the constructor."""
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, nested where they are settings themselves; as JSON can hold them."""
    @property
    def to_m(self) -> float:
        """m above the ground under it."""
    @to_m.setter
    def to_m(self, value: float) -> None: ...
    @property
    def width_m(self) -> float:
        """m."""
    @width_m.setter
    def width_m(self, value: float) -> None: ...

class Circle:
    """A disc on a surface."""
    def __repr__(self) -> str: ...
    @property
    def center(self) -> npt.NDArray[np.float64]:
        """(3,) float64, map frame, m, on the plane; a view."""
    @property
    def radius(self) -> float:
        """m."""
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, as JSON can hold them."""

class ContactLimits:
    """What a contact needs. The defaults ask nothing but slope and support."""
    def __eq__(self, other: object) -> bool: ...
    def __init__(self, *, clearance_m: float = ..., edge_margin_m: float = ..., frontier_margin_m: float = ..., gap_depth_m: float = ..., max_normal_std_rad: Optional[float] = ..., max_offset_std_m: Optional[float] = ..., max_rms_m: Optional[float] = ..., max_slope_rad: float = ..., min_area_m2: float = ..., obstacle_from_m: float = ..., obstacle_margin_m: float = ..., up: npt.ArrayLike = ...) -> None: ...
    def __repr__(self) -> str: ...
    @property
    def clearance_m(self) -> float:
        """m along the normal with nothing over the contact; 0: not asked."""
    @clearance_m.setter
    def clearance_m(self, value: float) -> None: ...
    @property
    def edge_margin_m(self) -> float:
        """m between the contact and every edge; outlines reach up to d beyond what is there."""
    @edge_margin_m.setter
    def edge_margin_m(self, value: float) -> None: ...
    @staticmethod
    def from_dict(values: Dict[str, Any]) -> ContactLimits:
        """Back from to_dict(); what is missing keeps its default. Throws Error(usage) for a name that is no field."""
    @property
    def frontier_margin_m(self) -> float:
        """m between the contact and edges of kind frontier."""
    @frontier_margin_m.setter
    def frontier_margin_m(self, value: float) -> None: ...
    @property
    def gap_depth_m(self) -> float:
        """m of free space under the contact that make a gap, refused as support; 0: not asked."""
    @gap_depth_m.setter
    def gap_depth_m(self, value: float) -> None: ...
    @property
    def max_normal_std_rad(self) -> Optional[float]:
        """rad; None: any."""
    @max_normal_std_rad.setter
    def max_normal_std_rad(self, value: Optional[float]) -> None: ...
    @property
    def max_offset_std_m(self) -> Optional[float]:
        """m; None: any."""
    @max_offset_std_m.setter
    def max_offset_std_m(self, value: Optional[float]) -> None: ...
    @property
    def max_rms_m(self) -> Optional[float]:
        """m, roughness; None: any."""
    @max_rms_m.setter
    def max_rms_m(self, value: Optional[float]) -> None: ...
    @property
    def max_slope_rad(self) -> float:
        """rad, of the surface; pi: any, walls and ceilings too."""
    @max_slope_rad.setter
    def max_slope_rad(self, value: float) -> None: ...
    @property
    def min_area_m2(self) -> float:
        """m2, of the surface."""
    @min_area_m2.setter
    def min_area_m2(self, value: float) -> None: ...
    @property
    def obstacle_from_m(self) -> float:
        """m above the plane from which voxels are obstacles."""
    @obstacle_from_m.setter
    def obstacle_from_m(self, value: float) -> None: ...
    @property
    def obstacle_margin_m(self) -> float:
        """m between the contact and what is occupied above the surface; 0: not asked; needs a clearance."""
    @obstacle_margin_m.setter
    def obstacle_margin_m(self, value: float) -> None: ...
    def replaced(self, *, clearance_m: float = ..., edge_margin_m: float = ..., frontier_margin_m: float = ..., gap_depth_m: float = ..., max_normal_std_rad: Optional[float] = ..., max_offset_std_m: Optional[float] = ..., max_rms_m: Optional[float] = ..., max_slope_rad: float = ..., min_area_m2: float = ..., obstacle_from_m: float = ..., obstacle_margin_m: float = ..., up: npt.ArrayLike = ...) -> ContactLimits:
        """A copy with the fields set that are given, by name as to the constructor."""
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, nested where they are settings themselves; as JSON can hold them."""
    @property
    def up(self) -> npt.NDArray[np.float64]:
        """(3,) float64, map frame, any length; Snapshot.up() is a map's; a view."""
    @up.setter
    def up(self, value: npt.ArrayLike) -> None: ...

class ContactRegion:
    """Where on one surface a contact's reference point may be so that every limit is kept."""
    def __repr__(self) -> str: ...
    @property
    def area_m2(self) -> float:
        """m2."""
    @property
    def polygons(self) -> List[Polygon]:
        """List of Polygon, surface frame, m."""
    @property
    def refused(self) -> List[str]:
        """If there is no polygon: the limits that leave nothing: "slope", "size", "roughness", "uncertainty",
        "support", "margin", "frontier", "obstacle", "clearance".
        """
    @property
    def revision(self) -> int:
        """Of the surface it was made from."""
    @property
    def surface(self) -> int:
        """Id."""
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, as JSON can hold them."""
    @property
    def yaw_rad(self) -> Optional[float]:
        """rad; None: any heading will do there."""

class ContactShape:
    """What touches a surface: the sole of a foot, or a palm.

    In the contact's own frame, m: its reference point is the origin, x forward, y left, z away from the surface.
    """
    def __repr__(self) -> str: ...
    @staticmethod
    def disc(radius: float) -> ContactShape:
        """A ball foot, m."""
    @staticmethod
    def from_dict(values: Dict[str, Any]) -> ContactShape:
        """Back from to_dict()."""
    @property
    def outline(self) -> npt.NDArray[np.float64]:
        """(N, 2) float64, m, counter-clockwise; empty: a disc; a read-only view."""
    @staticmethod
    def polygon(outline: npt.ArrayLike) -> ContactShape:
        """(N, 2), m, convex, counter-clockwise, at least three vertices."""
    @property
    def radius(self) -> float:
        """m, of a disc."""
    def reach(self) -> float:
        """m: the farthest that any part lies from the reference point."""
    @staticmethod
    def rectangle(length: float, width: float, behind: Optional[float] = ...) -> ContactShape:
        """A sole; its reference point is `behind` m in front of its heel, in its middle by default."""
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, as JSON can hold them."""

class ConvexPiece:
    """A convex part of a surface."""
    @property
    def A(self) -> npt.NDArray[np.float64]:
        """(N, 2) float64: the piece is A (u, v) <= b in the surface's frame, rows of unit length; a view."""
    def __repr__(self) -> str: ...
    @property
    def b(self) -> npt.NDArray[np.float64]:
        """(N,) float64, m; a view."""
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, as JSON can hold them."""
    @property
    def vertices(self) -> npt.NDArray[np.float64]:
        """(N, 3) float64, map frame, m, counter-clockwise seen from the normal's tip; a read-only view."""

class ConvexSpace:
    """All points with normal . x <= offset for each of its planes; map frame."""
    def __init__(self, planes: Sequence[Plane]) -> None:
        """Of a list of Plane."""
    def __repr__(self) -> str: ...
    @staticmethod
    def box(low: npt.ArrayLike, high: npt.ArrayLike) -> ConvexSpace:
        """A box by its corners, (3,) each, m."""
    @staticmethod
    def frustum(T_map_camera: npt.ArrayLike, tan_right: float, tan_down: float, near: float, far: float) -> ConvexSpace:
        """What a camera sees between two distances along its z axis, m.

        T_map_camera: (4, 4), x right, y down, z forward; tangents of the half angles to the right and down.
        """
    @property
    def planes(self) -> List[Plane]:
        """List of Plane."""
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, as JSON can hold them."""

class Cylinder:
    """A pillar, rail or rung: the part of its mantle that was seen. Map frame, m. Immutable."""
    def __repr__(self) -> str: ...
    @property
    def axis(self) -> npt.NDArray[np.float64]:
        """(3,) float64, unit; a view."""
    @property
    def axis_point(self) -> npt.NDArray[np.float64]:
        """(3,) float64, on the axis, in the middle; a view."""
    @property
    def born(self) -> int:
        """Map revision in which it appeared."""
    @property
    def id(self) -> int:
        """Never reused; numbered apart from surfaces."""
    @property
    def inliers(self) -> int:
        """Voxels."""
    @property
    def length_m(self) -> float:
        """m along the axis, from axis_point half to either side."""
    @property
    def radius_m(self) -> float:
        """m."""
    @property
    def revision(self) -> int:
        """Map revision of the last change."""
    @property
    def rms_m(self) -> float:
        """m, of the inliers' distances to the mantle."""
    @property
    def span_rad(self) -> float:
        """rad, counter-clockwise seen from the axis' tip."""
    @property
    def start(self) -> npt.NDArray[np.float64]:
        """(3,) float64, unit, square to the axis: what was seen lies within `span_rad` from here; a view."""
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, as JSON can hold them."""

class Departure:
    """A surface or cylinder that is no more."""
    def __repr__(self) -> str: ...
    @property
    def born(self) -> int:
        """Map revision in which it appeared; 0: before maps noted that."""
    @property
    def id(self) -> int:
        """Never used again."""
    @property
    def into(self) -> int:
        """Id of what took it in; 0: its points are pending again, or vanished."""
    @property
    def of(self) -> str:
        """"surface" or "cylinder"."""
    @property
    def parents(self) -> List[int]:
        """As Surface.parents when it went."""
    @property
    def revision(self) -> int:
        """Map revision in which it went."""
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, as JSON can hold them."""

class DetectionParameters:
    """New surfaces and cylinders among pending points."""
    def __eq__(self, other: object) -> bool: ...
    def __init__(self, *, detect_cylinders: bool = ..., detection_budget: int = ..., detector: str = ..., max_curvature: float = ..., min_surface_points: Optional[int] = ..., normal_radius: Optional[float] = ..., ransac_iterations: int = ..., search_radius: Optional[float] = ..., smoothness_angle: float = ...) -> None: ...
    def __repr__(self) -> str: ...
    @property
    def detect_cylinders(self) -> bool:
        """Look for pillars, rails and rungs among what no plane took."""
    @detect_cylinders.setter
    def detect_cylinders(self, value: bool) -> None: ...
    @property
    def detection_budget(self) -> int:
        """Pending readings in which a scan looks for surfaces at most, or a quarter of those that wait, if that is more; Mapper.drain() looks at the rest. 0: all at once."""
    @detection_budget.setter
    def detection_budget(self, value: int) -> None: ...
    @property
    def detector(self) -> str:
        """How surfaces are found: likelihood, or paper, whose maps Python reads and does not go on with."""
    @detector.setter
    def detector(self, value: str) -> None: ...
    @staticmethod
    def from_dict(values: Dict[str, Any]) -> DetectionParameters:
        """Back from to_dict(); what is missing keeps its default. Throws Error(usage) for a name that is no field."""
    @property
    def max_curvature(self) -> float:
        """Region growing, surface variation: likewise."""
    @max_curvature.setter
    def max_curvature(self, value: float) -> None: ...
    @property
    def min_surface_points(self) -> Optional[int]:
        """n; None: derived."""
    @min_surface_points.setter
    def min_surface_points(self, value: Optional[int]) -> None: ...
    @property
    def normal_radius(self) -> Optional[float]:
        """m: cylinders: neighbourhood for normals where points are dense and exact; None: derived."""
    @normal_radius.setter
    def normal_radius(self, value: Optional[float]) -> None: ...
    @property
    def ransac_iterations(self) -> int:
        """RANSAC: likewise."""
    @ransac_iterations.setter
    def ransac_iterations(self, value: int) -> None: ...
    def replaced(self, *, detect_cylinders: bool = ..., detection_budget: int = ..., detector: str = ..., max_curvature: float = ..., min_surface_points: Optional[int] = ..., normal_radius: Optional[float] = ..., ransac_iterations: int = ..., search_radius: Optional[float] = ..., smoothness_angle: float = ...) -> DetectionParameters:
        """A copy with the fields set that are given, by name as to the constructor."""
    @property
    def search_radius(self) -> Optional[float]:
        """r, m: the paper's detector: of outliers and normals; cylinders: largest neighbourhood; None: derived."""
    @search_radius.setter
    def search_radius(self, value: Optional[float]) -> None: ...
    @property
    def smoothness_angle(self) -> float:
        """rad: region growing, normal difference: the paper's detector, and cylinders."""
    @smoothness_angle.setter
    def smoothness_angle(self, value: float) -> None: ...
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, nested where they are settings themselves; as JSON can hold them."""

class DoubleLayer:
    """Two surfaces where the world most likely has one."""
    def __repr__(self) -> str: ...
    @property
    def angle_rad(self) -> float:
        """rad, between the planes."""
    @property
    def distance_m(self) -> float:
        """m, mean over the overlap."""
    @property
    def first(self) -> int:
        """Id."""
    @property
    def overlap_m2(self) -> float:
        """m2, of their polygons where they are near each other."""
    @property
    def second(self) -> int:
        """Id."""
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, as JSON can hold them."""

class Explanation:
    """Why there is no surface at a place, or that there is one."""
    def __repr__(self) -> str: ...
    @property
    def around(self) -> Dict[str, int]:
        """dict of counts by reason, of the pending points within h."""
    @property
    def asked(self) -> npt.NDArray[np.float64]:
        """(3,) float64, map frame, m; a view."""
    @property
    def cylinder(self) -> int:
        """Id of the cylinder that the point supports; 0: none."""
    @property
    def figures(self) -> List[Figure]:
        """List of Figure."""
    @property
    def looked_at(self) -> Optional[npt.NDArray[np.float64]]:
        """(3,) float64, the nearest point within h, a copy; or None."""
    @property
    def nearest(self) -> int:
        """Id of the surface with the nearest inlier; 0: no surfaces."""
    @property
    def nearest_distance(self) -> float:
        """m, to that inlier."""
    @property
    def reason(self) -> str:
        """Such as "on_surface", "too_narrow"."""
    @property
    def sentence(self) -> str:
        """Plain English, one line."""
    @property
    def surface(self) -> int:
        """Id of the surface the reason is about; 0: none."""
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, as JSON can hold them."""

class Figure:
    """A number behind an explanation, and the bound it was held against."""
    def __repr__(self) -> str: ...
    @property
    def at_least(self) -> Optional[float]:
        """Lower bound, or None."""
    @property
    def name(self) -> str:
        """Such as "width"."""
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, as JSON can hold them."""
    @property
    def unit(self) -> str:
        """Empty for counts and shares."""
    @property
    def value(self) -> float:
        """In `unit`."""

class Foothold:
    """One contact at a place, and what is to be said about it."""
    @property
    def T_map_contact(self) -> npt.NDArray[np.float64]:
        """(4, 4) float64, on the plane, z along its normal; a copy."""
    def __repr__(self) -> str: ...
    @property
    def accepted(self) -> bool:
        """Every limit is kept."""
    @property
    def margin_m(self) -> float:
        """m to the nearest edge; negative: how much is beyond it."""
    @property
    def refused(self) -> Optional[str]:
        """The first limit that is not, or None."""
    @property
    def supported(self) -> float:
        """Share of the contact's area that lies on the surface, [0, 1]."""
    @property
    def surface(self) -> int:
        """Id."""
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, as JSON can hold them."""

class Footstep:
    """A foot put down."""
    @property
    def T_map_foot(self) -> npt.NDArray[np.float64]:
        """(4, 4) float64, reference point, z along the normal; a copy."""
    def __repr__(self) -> str: ...
    @property
    def foot(self) -> str:
        """"left", "right"; "front_left", "front_right", "hind_left", "hind_right"."""
    @property
    def margin_m(self) -> float:
        """m from the sole to the surface's nearest edge."""
    @property
    def surface(self) -> int:
        """Id."""
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, as JSON can hold them."""
    @property
    def yaw_rad(self) -> float:
        """rad, as Standing's."""

class FootstepPlan:
    """Footsteps, or why there are none."""
    def __bool__(self) -> bool:
        """found()."""
    def __repr__(self) -> str: ...
    @property
    def body(self) -> List[Standing]:
        """List of Standing: the body's pose at first and after each step."""
    @property
    def cost(self) -> float:
        """Of all steps."""
    @property
    def expansions(self) -> int:
        """Of the search."""
    def found(self) -> bool:
        """Whether there is a plan."""
    @property
    def lower_bound(self) -> float:
        """No plan on the planner's grid costs less."""
    @property
    def prepare_ms(self) -> float:
        """ms: contact regions and voxels that no earlier plan had asked for."""
    @property
    def refusal(self) -> Optional[NoPlan]:
        """NoPlan, or None: there is a plan."""
    @property
    def search_ms(self) -> float:
        """ms: all the rest."""
    @property
    def start(self) -> List[Footstep]:
        """List of Footstep: where the feet stand at first."""
    @property
    def steps(self) -> List[Footstep]:
        """List of Footstep, one after the other."""
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, as JSON can hold them."""
    def to_json(self, robot: Union[Biped, Quadruped]) -> str:
        """A JSON object, "octosurf-plan" of docs/formats.md; degrees."""

class FootstepPlanner:
    """Plans footsteps over the surfaces of one snapshot.

    Footholds are accepted by foothold(); swinging feet and body touch no occupied voxel, unknown space counts as free. Statics
    only. Deterministic without a time limit. What it finds out about the map it keeps for later plans.
    """
    def __init__(self, snapshot: Snapshot, robot: Optional[Union[Biped, Quadruped]] = ..., *, octree: Optional[OccupancyView] = ..., edges: Mapping[int, Sequence[PolygonEdges]] = ...) -> None:
        """robot: Biped or Quadruped; None: Biped() with the map's up. octree: OccupancyView; None: the snapshot's own.
        edges: label_edges() by surface id, for limits that ask for them. Throws Error(usage).
        """
    def __repr__(self) -> str: ...
    def plan(self, from_: Standing, to: Standing, budget: PlanBudget = ...) -> FootstepPlan:
        """FootstepPlan from one Standing to another; at both ends the feet are put on the footholds nearest."""

class HeightGrid:
    """Heights of what can be stepped on over a grid of square cells.

    As grid_map has it: element (0, 0) is the cell in the +x, +y corner, rows go against x and columns against y.
    """
    def __repr__(self) -> str: ...
    @property
    def cell(self) -> float:
        """m, edge of a cell."""
    @property
    def center(self) -> npt.NDArray[np.float64]:
        """(2,) float64, of the whole grid, m; a view."""
    def center_of(self, row: int, column: int) -> npt.NDArray[np.float64]:
        """(2,) float64, m."""
    @property
    def elevation(self) -> npt.NDArray[np.float32]:
        """(rows, columns) float32, m; NaN where there is nothing; a view."""
    @property
    def normal(self) -> Tuple[Any, ...]:
        """(x, y, z) of the surface's normal there, (rows, columns) float32 each; views."""
    @property
    def surface(self) -> npt.NDArray[np.float32]:
        """(rows, columns) float32, its id; a view."""
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, as JSON can hold them."""

class IhmcRegion:
    """A planar region as IHMC's planners know it."""
    @property
    def T_world_region(self) -> npt.NDArray[np.float64]:
        """(4, 4) float64; a copy."""
    def __repr__(self) -> str: ...
    @property
    def hull(self) -> npt.NDArray[np.float64]:
        """(N, 2) float64, counter-clockwise, region frame, m; a read-only view."""
    @property
    def id(self) -> int:
        """Of the surface."""
    @property
    def polygons(self) -> List[npt.NDArray[np.float64]]:
        """List of (M, 2) float64, convex, counter-clockwise, region frame, m; read-only views."""
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, as JSON can hold them."""

class Localizer:
    """Finds scans in a finished map; keeps what it builds from scan to scan."""
    def __init__(self, map: Snapshot, *, translation_m: float = ..., rotation_rad: float = ...) -> None:
        """map: a Snapshot. Looks so far about a scan's pose: m, rad."""
    def __repr__(self) -> str: ...
    def localize(self, scan: Scan) -> Alignment:
        """Alignment of a Scan, whose T_map_sensor is a first guess.

        Outcome "unexplained": it fits nowhere or at several places alike. Throws Error(data) if the pose is not rigid.
        """

class Map:
    """The persistent thing: octree, surfaces, pending points, parameters.

    Given to a Mapper it goes on being readable; what one thread asks of it then waits for the scan that another one
    inserts, but for snapshot(), which never waits.
    """
    def __init__(self, parameters: Optional[Parameters] = ..., *, align: bool = ..., alignment: Union[AlignmentParameters, Mapping[str, Any]] = ..., clamp_max: float = ..., clamp_min: float = ..., detect_cylinders: bool = ..., detection: Union[DetectionParameters, Mapping[str, Any]] = ..., detection_budget: int = ..., detector: str = ..., hit: float = ..., max_curvature: float = ..., max_hole_size: Optional[float] = ..., max_range: Optional[float] = ..., mesh_thickness: float = ..., min_range: float = ..., min_surface_points: Optional[int] = ..., min_surface_width: float = ..., miss: float = ..., normal_radius: Optional[float] = ..., occupancy: Union[OccupancyParameters, Mapping[str, Any]] = ..., occupied: float = ..., preserve_surfaces: bool = ..., range_noise: Optional[float] = ..., ransac_iterations: int = ..., resolution: float = ..., search_radius: Optional[float] = ..., sensor_noise: float = ..., smoothness_angle: float = ..., surface_tolerance: Optional[float] = ..., surfaces: Union[SurfaceParameters, Mapping[str, Any]] = ..., up: Optional[npt.ArrayLike] = ...) -> None:
        """An empty map, Map(resolution=0.02); what is given by name wins over `parameters`. Throws Error(usage) for what is out of range."""
    def __repr__(self) -> str: ...
    def at(self, point: npt.ArrayLike) -> MapVoxel:
        """The MapVoxel that holds `point`, (3,), map frame."""
    def check_invariants(self) -> List[str]:
        """A line for each violation; none if all is well. One pass over octree and surfaces."""
    def holds(self, scan: Scan) -> bool:
        """Whether a Mapper has put this Scan into it after Mapper.remember_scans(), also before the map was saved.

        Compares its pose as it was given, its number of points and up to 4096 of them.
        """
    def octree(self) -> OccupancyView:
        """OccupancyView as it is now."""
    def parameters(self) -> Parameters:
        """A copy of its Parameters."""
    def points(self) -> npt.NDArray[np.void]:
        """The points of all occupied voxels, in key order; a structured array of its own.

        Columns: "point" (3 float64, map frame, m), "view" (3 float64, unit, toward where it was seen from; NaN: not known),
        "log_odds" (float32), "surface" (uint32; 0: pending).
        """
    def size(self) -> MapSize:
        """MapSize."""
    def snapshot(self) -> Snapshot:
        """Snapshot of the last whole scan; shared, nothing is copied."""

class MapAlignment:
    """Where another map lies in the frame of a map."""
    @property
    def T_map_other(self) -> npt.NDArray[np.float64]:
        """(4, 4) float64, the other map's frame to this one's; as given unless scan.outcome is "corrected"; a copy."""
    def __repr__(self) -> str: ...
    @property
    def scan(self) -> Alignment:
        """Alignment of the other map's points as one scan."""
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, as JSON can hold them."""

class MapChanges:
    """What became of what somebody knew at an earlier revision. Ids ascend."""
    def __repr__(self) -> str: ...
    @property
    def appeared(self) -> List[int]:
        """Ids of surfaces that were not there."""
    @property
    def changed(self) -> List[int]:
        """Ids of surfaces with another plane, polygon or covariance."""
    @property
    def cylinders_appeared(self) -> List[int]:
        """Ids."""
    @property
    def cylinders_changed(self) -> List[int]:
        """Ids."""
    @property
    def cylinders_gone(self) -> List[int]:
        """Ids."""
    @property
    def cylinders_merged(self) -> List[Tuple[int, int]]:
        """As merged."""
    @property
    def gone(self) -> List[int]:
        """Ids of surfaces that nothing there now holds."""
    @property
    def merged(self) -> List[Tuple[int, int]]:
        """List of (before, now): `before` is no more, `now` holds all or a part of it."""
    @property
    def revision(self) -> int:
        """The present one."""
    @property
    def since(self) -> int:
        """The earlier revision."""
    @property
    def split(self) -> List[Tuple[int, int]]:
        """List of (before, now): `before` is still there, `now` has a part of it."""
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, as JSON can hold them."""

class MapDifference:
    """Two maps compared."""
    def __repr__(self) -> str: ...
    @property
    def after(self) -> List[SurfaceDifference]:
        """Likewise of the second."""
    @property
    def before(self) -> List[SurfaceDifference]:
        """List of SurfaceDifference, every surface of the first."""
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, as JSON can hold them."""

class MapSize:
    """What is in a Map."""
    def __repr__(self) -> str: ...
    @property
    def bytes(self) -> int:
        """Of the octree."""
    @property
    def inliers(self) -> int:
        """Points that surfaces have."""
    @property
    def leaves(self) -> int:
        """Of the octree."""
    @property
    def nodes(self) -> int:
        """Of the octree."""
    @property
    def pending(self) -> int:
        """Points that no surface has."""
    @property
    def points(self) -> int:
        """Occupied voxels that have a point."""
    @property
    def revision(self) -> int:
        """Of the map."""
    @property
    def scans(self) -> int:
        """Inserted."""
    @property
    def surfaces(self) -> int:
        """Number of them."""
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, as JSON can hold them."""

class MapVoxel:
    """A voxel of a Map with what it keeps of the scans."""
    def __repr__(self) -> str: ...
    @property
    def log_odds(self) -> float:
        """Of being occupied."""
    @property
    def occupancy(self) -> str:
        """"unknown", "free" or "occupied"."""
    @property
    def point(self) -> Optional[npt.NDArray[np.float64]]:
        """(3,) float64, map frame, m: its representative point, a copy; or None."""
    @property
    def surface(self) -> int:
        """Id; 0: pending, or not occupied."""
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, as JSON can hold them."""
    @property
    def view(self) -> Optional[npt.NDArray[np.float64]]:
        """(3,) float64, unit, toward where it was seen from, a copy; or None."""

class Mapper:
    """Keeps a map and its surfaces up to date, scan by scan.

    1. Same scans and parameters, same map, byte for byte, whatever `threads` is.
    2. All or nothing: whatever is raised, Error or MemoryError, the map is what it was before the call, and goes on.
    3. snapshot() may be called from any thread at any time and never waits for an insertion.
    4. While a scan is inserted, other Python threads run; a second insertion waits for the first.
    """
    @overload
    def __init__(self, map: Map, threads: int = ...) -> None:
        """Goes on with a Map that has no Mapper yet."""
    @overload
    def __init__(self, parameters: Optional[Parameters] = ..., threads: int = ..., *, align: bool = ..., alignment: Union[AlignmentParameters, Mapping[str, Any]] = ..., clamp_max: float = ..., clamp_min: float = ..., detect_cylinders: bool = ..., detection: Union[DetectionParameters, Mapping[str, Any]] = ..., detection_budget: int = ..., detector: str = ..., hit: float = ..., max_curvature: float = ..., max_hole_size: Optional[float] = ..., max_range: Optional[float] = ..., mesh_thickness: float = ..., min_range: float = ..., min_surface_points: Optional[int] = ..., min_surface_width: float = ..., miss: float = ..., normal_radius: Optional[float] = ..., occupancy: Union[OccupancyParameters, Mapping[str, Any]] = ..., occupied: float = ..., preserve_surfaces: bool = ..., range_noise: Optional[float] = ..., ransac_iterations: int = ..., resolution: float = ..., search_radius: Optional[float] = ..., sensor_noise: float = ..., smoothness_angle: float = ..., surface_tolerance: Optional[float] = ..., surfaces: Union[SurfaceParameters, Mapping[str, Any]] = ..., up: Optional[npt.ArrayLike] = ...) -> None:
        """Begins an empty map: Mapper(), Mapper(resolution=0.02, up=None), Mapper(parameters).

        What is given by name, as Parameters() takes it, wins over `parameters`. `threads` in [1, 256] share a scan's points and
        rays. Throws Error(usage).
        """
    def __repr__(self) -> str: ...
    def detect_in_occupancy(self) -> ScanReport:
        """Surfaces of an occupancy map without scans (map_from_octomap()): a ScanReport."""
    def drain(self) -> ScanReport:
        """Looks for surfaces in all that waits because scans had brought more than Parameters.detection.detection_budget.

        After the last scan, and whenever there is time. Without effect if nothing waits. Returns a ScanReport.
        """
    def insert(self, scan: Scan) -> ScanReport:
        """Inserts a Scan and returns its ScanReport; nothing is copied.

        Throws Error(data), and leaves the map as it was, if the pose is not rigid or outside the octree. A scan that is clearly off
        and not to be put right is not inserted: report.alignment.outcome is "set_aside".
        """
    def insert_all(self, scans: Sequence[Scan]) -> List[ScanReport]:
        """Inserts Scans that have come while others were mapped, and returns a ScanReport for each that was taken.

        The octree takes one after the other, the surfaces are brought up to date once: ten cost little more than two. Stops before a
        scan that insert() would refuse; if that is the first, throws its Error(data), and leaves the map as it was. The scans are copied.
        """
    def insert_depth(self, depth: npt.ArrayLike, intrinsics: Any, T_map_camera: npt.ArrayLike, *, depth_scale: float = ..., stamp_s: float = ..., name: str = ...) -> ScanReport:
        """Scan.from_depth(depth, intrinsics, T_map_camera, …) inserted: an image (H, W), uint16 units or metres."""
    def insert_points(self, points: npt.ArrayLike, T_map_sensor: npt.ArrayLike, *, stamp_s: float = ..., sensor: str = ..., name: str = ...) -> ScanReport:
        """Scan(points, T_map_sensor, …) inserted: points (..., 3), m, sensor frame, copied; pose (4, 4)."""
    def map(self) -> Map:
        """The Map that it keeps up to date; shared, not copied."""
    def merge(self, other: Map, T_map_other: npt.ArrayLike = ...) -> MergeReport:
        """Takes in another Map, which stays as it is: a MergeReport.

        T_map_other, (4, 4), is the other map's frame in this one's, right to about a voxel (align_maps()); with the identity
        nothing is resampled. Log-odds add up, so the maps must not share scans; surfaces that are here keep their ids.
        Throws Error(data), and leaves the map as it was, if the maps' resolution, clamps or threshold of occupancy differ, or
        the pose is not rigid. Some 10 µs a point of the other map.
        """
    def remember_scans(self) -> None:
        """From now on the map remembers which scans it takes, see Map.holds(): 8 bytes each, saved with it."""
    def share_octree(self, on: bool = ...) -> None:
        """From now on snapshots have an octree of the same scan; costs a camera's scan some tenths of a ms."""
    def snapshot(self) -> Snapshot:
        """Snapshot of the last whole scan; shared, nothing is copied."""

class MergeReport:
    """What a merger did."""
    def __repr__(self) -> str: ...
    @property
    def changes(self) -> ScanReport:
        """ScanReport; points_raw: those of the other map."""
    @property
    def surfaces(self) -> List[MergedSurface]:
        """Each of the other map's: list of MergedSurface, ascending id there."""
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, as JSON can hold them."""

class MergedSurface:
    """What became of another map's surface."""
    def __repr__(self) -> str: ...
    @property
    def id(self) -> int:
        """The surface here that has most of its points; 0: none has any."""
    @property
    def inliers(self) -> int:
        """Points that it had there."""
    @property
    def on_surfaces(self) -> int:
        """Of them, in voxels of any surface here."""
    @property
    def other(self) -> int:
        """Its id in the other map."""
    @property
    def shared(self) -> int:
        """Of them, in voxels of surface `id` here."""
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, as JSON can hold them."""

class Mesh:
    """Closed triangle mesh, map frame, m; counter-clockwise seen from outside."""
    def __repr__(self) -> str: ...
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, as JSON can hold them."""
    @property
    def triangles(self) -> npt.NDArray[np.uint32]:
        """(M, 3) uint32, rows of `vertices`; a copy."""
    @property
    def vertices(self) -> npt.NDArray[np.float64]:
        """(N, 3) float64; a read-only view."""

class Nearest:
    """The place on a surface that is nearest to a point."""
    def __repr__(self) -> str: ...
    @property
    def distance(self) -> float:
        """m."""
    @property
    def id(self) -> int:
        """Of the surface."""
    @property
    def point(self) -> npt.NDArray[np.float64]:
        """(3,) float64, map frame, m, on its polygons; a view."""
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, as JSON can hold them."""

class NoPlan:
    """Why there is no plan."""
    def __repr__(self) -> str: ...
    @property
    def contact(self) -> Optional[str]:
        """Of start and goal: the limit that keeps the foot from there, or None."""
    @property
    def nearest(self) -> Optional[npt.NDArray[np.float64]]:
        """(3,) float64, map frame, m, a copy: where it came nearest; of start and goal the nearest place to stand; or None."""
    @property
    def nearest_m(self) -> float:
        """m from there to the goal, or to the start."""
    @property
    def refused(self) -> Dict[str, int]:
        """dict: footholds nearer to the goal that "reach", "height", "clearance", "support" refused."""
    @property
    def sentence(self) -> str:
        """One line."""
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, as JSON can hold them."""
    @property
    def why(self) -> str:
        """"start", "goal", "unreachable" or "budget"."""

class OccupancyParameters:
    """The octree and what a scan does to it."""
    def __eq__(self, other: object) -> bool: ...
    def __init__(self, *, clamp_max: float = ..., clamp_min: float = ..., hit: float = ..., max_range: Optional[float] = ..., min_range: float = ..., miss: float = ..., occupied: float = ..., preserve_surfaces: bool = ..., resolution: float = ...) -> None: ...
    def __repr__(self) -> str: ...
    @property
    def clamp_max(self) -> float:
        """Probability, upper clamp."""
    @clamp_max.setter
    def clamp_max(self, value: float) -> None: ...
    @property
    def clamp_min(self) -> float:
        """Probability, lower clamp."""
    @clamp_min.setter
    def clamp_min(self, value: float) -> None: ...
    @staticmethod
    def from_dict(values: Dict[str, Any]) -> OccupancyParameters:
        """Back from to_dict(); what is missing keeps its default. Throws Error(usage) for a name that is no field."""
    @property
    def hit(self) -> float:
        """P(occupied | endpoint)."""
    @hit.setter
    def hit(self, value: float) -> None: ...
    @property
    def max_range(self) -> Optional[float]:
        """m: beyond it points only free space; None: 4 for depth cameras, unlimited for lidar."""
    @max_range.setter
    def max_range(self, value: Optional[float]) -> None: ...
    @property
    def min_range(self) -> float:
        """m: nearer points are dropped."""
    @min_range.setter
    def min_range(self, value: float) -> None: ...
    @property
    def miss(self) -> float:
        """P(occupied | ray passed through)."""
    @miss.setter
    def miss(self, value: float) -> None: ...
    @property
    def occupied(self) -> float:
        """Probability from which a voxel counts as occupied."""
    @occupied.setter
    def occupied(self, value: float) -> None: ...
    @property
    def preserve_surfaces(self) -> bool:
        """A ray erodes a surface's voxel only if it crosses its plane beyond s; off: the tree equals OctoMap's."""
    @preserve_surfaces.setter
    def preserve_surfaces(self, value: bool) -> None: ...
    def replaced(self, *, clamp_max: float = ..., clamp_min: float = ..., hit: float = ..., max_range: Optional[float] = ..., min_range: float = ..., miss: float = ..., occupied: float = ..., preserve_surfaces: bool = ..., resolution: float = ...) -> OccupancyParameters:
        """A copy with the fields set that are given, by name as to the constructor."""
    @property
    def resolution(self) -> float:
        """d, m: voxel edge; also of downsampling and change detection."""
    @resolution.setter
    def resolution(self, value: float) -> None: ...
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, nested where they are settings themselves; as JSON can hold them."""

class OccupancyView:
    """A map's octree at one moment: never changes, cheap to keep, readable from any thread.

    Voxels are half-open cubes of edge `resolution`; what lies on a face belongs to the higher one. Points are in the map
    frame, metres. Boxes are closed and given by their corners `low` and `high`, (3,) each.
    """
    class Count:
        """Voxels by state."""
        def __repr__(self) -> str: ...
        @property
        def free(self) -> int:
            """Voxels."""
        @property
        def occupied(self) -> int:
            """Voxels."""
        def to_dict(self) -> Dict[str, Any]:
            """The fields by name, as JSON can hold them."""
        @property
        def unknown(self) -> int:
            """Voxels."""
    class Voxel:
        """A cube of edge OccupancyView.resolution."""
        def __repr__(self) -> str: ...
        @property
        def center(self) -> npt.NDArray[np.float64]:
            """(3,) float64, map frame, m; a view."""
        @property
        def log_odds(self) -> float:
            """Of being occupied."""
        @property
        def state(self) -> str:
            """"unknown", "free" or "occupied"."""
        @property
        def surface(self) -> int:
            """Id of the surface an occupied voxel belongs to; 0: pending, or not occupied."""
        def to_dict(self) -> Dict[str, Any]:
            """The fields by name, as JSON can hold them."""
    def __repr__(self) -> str: ...
    def at(self, point: npt.ArrayLike) -> OccupancyView.Voxel:
        """The Voxel that holds `point`, (3,); unknown outside the octree."""
    def changes(self, before: OccupancyView) -> List[Tuple[List[int], int, npt.NDArray[np.void]]]:
        """What has changed since `before`, an earlier view: a list of (corner, level, leaves).

        Each is a cube that was replaced: its lowest voxel's key, its edge as 2**level voxels, and the leaves that are in it
        now, as leaves() has them; none if nothing is known there any longer.
        """
    def count(self, low: npt.ArrayLike, high: npt.ArrayLike) -> OccupancyView.Count:
        """How many voxels with their centre in the box are in each state."""
    def first_on_way(self, from_: npt.ArrayLike, to: npt.ArrayLike, unknown_stops: bool = ...) -> Optional[OccupancyView.Voxel]:
        """The first Voxel that stops the straight way between two points: an occupied one, or an unknown one too.

        None if there is none. Throws Error(usage) if a point is not finite.
        """
    def leaves(self) -> npt.NDArray[np.void]:
        """All leaves as OctoMap's octree would have them, pruned, in Morton order; a structured array of its own.

        Columns: "corner" (3 uint16, OctoMap's key of its lowest voxel; 32768 begins at 0 m), "level" (uint8: its edge is
        2**level voxels), "log_odds" (float32).
        """
    def leaves_in(self, low: npt.ArrayLike, high: npt.ArrayLike) -> npt.NDArray[np.void]:
        """Those that meet the box; where it cuts a pruned cube, what of that meets it."""
    def nearest_occupied(self, point: npt.ArrayLike, limit: float) -> Optional[Tuple[OccupancyView.Voxel, float]]:
        """The occupied Voxel nearest to `point` and its distance, m; None if it is farther than `limit` m."""
    def occupied(self, low: npt.ArrayLike, high: npt.ArrayLike) -> npt.NDArray[np.void]:
        """Every occupied voxel with its centre in the box, in Morton order; a structured array of its own.

        Columns: "center" (3 float64, m), "log_odds" (float32), "surface" (uint32; 0: pending).
        """
    @property
    def resolution(self) -> float:
        """d, m; 0 if nothing is known."""
    def states(self, points: npt.ArrayLike) -> npt.NDArray[np.uint8]:
        """(N,) uint8, one for each row of `points`, (N, 3): 0 unknown, 1 free, 2 occupied."""

class Parameters:
    """Everything that decides what comes out; equal Parameters and scans give equal maps.

    SI units, angles in radians. A field that is None is derived from the others; an explicit value wins. The constructor takes
    the fields of its settings by their own names, too, and `align` for alignment.enabled: Parameters(resolution=0.01, up=None) is
    Parameters(occupancy={"resolution": 0.01}, up=None). Fields can be set afterwards, too.
    """
    def __eq__(self, other: object) -> bool: ...
    def __init__(self, *, align: bool = ..., alignment: Union[AlignmentParameters, Mapping[str, Any]] = ..., clamp_max: float = ..., clamp_min: float = ..., detect_cylinders: bool = ..., detection: Union[DetectionParameters, Mapping[str, Any]] = ..., detection_budget: int = ..., detector: str = ..., hit: float = ..., max_curvature: float = ..., max_hole_size: Optional[float] = ..., max_range: Optional[float] = ..., mesh_thickness: float = ..., min_range: float = ..., min_surface_points: Optional[int] = ..., min_surface_width: float = ..., miss: float = ..., normal_radius: Optional[float] = ..., occupancy: Union[OccupancyParameters, Mapping[str, Any]] = ..., occupied: float = ..., preserve_surfaces: bool = ..., range_noise: Optional[float] = ..., ransac_iterations: int = ..., resolution: float = ..., search_radius: Optional[float] = ..., sensor_noise: float = ..., smoothness_angle: float = ..., surface_tolerance: Optional[float] = ..., surfaces: Union[SurfaceParameters, Mapping[str, Any]] = ..., up: Optional[npt.ArrayLike] = ...) -> None: ...
    def __repr__(self) -> str: ...
    @property
    def alignment(self) -> AlignmentParameters:
        """AlignmentParameters."""
    @alignment.setter
    def alignment(self, value: AlignmentParameters) -> None: ...
    @property
    def detection(self) -> DetectionParameters:
        """DetectionParameters."""
    @detection.setter
    def detection(self, value: DetectionParameters) -> None: ...
    @staticmethod
    def from_dict(values: Dict[str, Any]) -> Parameters:
        """Back from to_dict(); what is missing keeps its default. Throws Error(usage) for a name that is no field."""
    def get(self, name: str) -> str:
        """The value in force as text, as `octosurf map --show-parameters` has it: angles in degrees."""
    def max_hole_size(self) -> float:
        """h in force, m."""
    def min_surface_points(self) -> int:
        """n in force."""
    @staticmethod
    def names() -> List[str]:
        """Of get() and set(); docs/parameters.md says what each does."""
    def normal_radius(self) -> float:
        """In force, m."""
    @property
    def occupancy(self) -> OccupancyParameters:
        """OccupancyParameters."""
    @occupancy.setter
    def occupancy(self, value: OccupancyParameters) -> None: ...
    @staticmethod
    def paper() -> Parameters:
        """The paper's detector and values (section V). Python has no such detector: set detection.detector to 'likelihood' to map with the values, or use `octosurf map --preset paper`."""
    def replaced(self, *, align: bool = ..., alignment: Union[AlignmentParameters, Mapping[str, Any]] = ..., clamp_max: float = ..., clamp_min: float = ..., detect_cylinders: bool = ..., detection: Union[DetectionParameters, Mapping[str, Any]] = ..., detection_budget: int = ..., detector: str = ..., hit: float = ..., max_curvature: float = ..., max_hole_size: Optional[float] = ..., max_range: Optional[float] = ..., mesh_thickness: float = ..., min_range: float = ..., min_surface_points: Optional[int] = ..., min_surface_width: float = ..., miss: float = ..., normal_radius: Optional[float] = ..., occupancy: Union[OccupancyParameters, Mapping[str, Any]] = ..., occupied: float = ..., preserve_surfaces: bool = ..., range_noise: Optional[float] = ..., ransac_iterations: int = ..., resolution: float = ..., search_radius: Optional[float] = ..., sensor_noise: float = ..., smoothness_angle: float = ..., surface_tolerance: Optional[float] = ..., surfaces: Union[SurfaceParameters, Mapping[str, Any]] = ..., up: Optional[npt.ArrayLike] = ...) -> Parameters:
        """A copy with the fields set that are given, by name as to the constructor."""
    def search_radius(self) -> float:
        """r in force, m."""
    def set(self, name: str, text: str) -> None:
        """Sets from text, as an option of `octosurf map` does: angles in degrees, "auto" for what is derived.
        Throws Error(usage) naming name, text and rule.
        """
    def surface_tolerance(self) -> float:
        """s in force, m."""
    @property
    def surfaces(self) -> SurfaceParameters:
        """SurfaceParameters."""
    @surfaces.setter
    def surfaces(self, value: SurfaceParameters) -> None: ...
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, nested where they are settings themselves; as JSON can hold them."""
    @property
    def up(self) -> Optional[npt.NDArray[np.float64]]:
        """(3,) float64, unit vector in the map frame against gravity, a copy; None: found from the surfaces."""
    @up.setter
    def up(self, value: Optional[npt.ArrayLike]) -> None: ...
    def validate(self) -> None:
        """Throws Error(usage) naming field, value and rule."""

class PlanBudget:
    """When to stop."""
    def __eq__(self, other: object) -> bool: ...
    def __init__(self, *, expansions: int = ..., improving: int = ..., time_s: Optional[float] = ...) -> None: ...
    def __repr__(self) -> str: ...
    @property
    def expansions(self) -> int:
        """To find a plan at all."""
    @expansions.setter
    def expansions(self, value: int) -> None: ...
    @staticmethod
    def from_dict(values: Dict[str, Any]) -> PlanBudget:
        """Back from to_dict(); what is missing keeps its default. Throws Error(usage) for a name that is no field."""
    @property
    def improving(self) -> int:
        """After the first plan, to find better ones."""
    @improving.setter
    def improving(self, value: int) -> None: ...
    def replaced(self, *, expansions: int = ..., improving: int = ..., time_s: Optional[float] = ...) -> PlanBudget:
        """A copy with the fields set that are given, by name as to the constructor."""
    @property
    def time_s(self) -> Optional[float]:
        """s, of the search; None: any. With it results depend on the machine."""
    @time_s.setter
    def time_s(self, value: Optional[float]) -> None: ...
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, nested where they are settings themselves; as JSON can hold them."""

class PlanarTerrainCount:
    """What a planar terrain has and what it left out."""
    def __repr__(self) -> str: ...
    @property
    def regions(self) -> int:
        """Written."""
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, as JSON can hold them."""
    @property
    def too_steep(self) -> int:
        """Polygons steeper than 80 degrees."""
    @property
    def without_inset(self) -> int:
        """Polygons on which no contact finds room."""

class Plane:
    """normal . x = offset, the normal toward the side it was seen from; map frame, m."""
    def __init__(self, normal: npt.ArrayLike, offset: float) -> None:
        """A plane of a unit normal, (3,)."""
    def __repr__(self) -> str: ...
    @property
    def normal(self) -> npt.NDArray[np.float64]:
        """(3,) float64, unit; a read-only view."""
    @property
    def offset(self) -> float:
        """m."""
    def signed_distance(self, point: npt.ArrayLike) -> float:
        """Of a point, (3,), m."""
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, as JSON can hold them."""

class PlannerSurface:
    """One surface, and where on it a contact's reference point may be."""
    @property
    def T_world_surface(self) -> npt.NDArray[np.float64]:
        """(4, 4) float64; a copy."""
    def __init__(self, surface: Surface, region: Optional[ContactRegion] = ..., pieces: Sequence[ConvexPiece] = ..., up: Optional[npt.ArrayLike] = ...) -> None:
        """Of a Surface, its ContactRegion (the insets) and convex_pieces(), in the world: the map with `up` turned to +z.

        up: (3,), map frame; None: as Surface.slope_rad() has it.
        """
    def __repr__(self) -> str: ...
    @property
    def id(self) -> int:
        """Of the surface."""
    @property
    def insets(self) -> List[Polygon]:
        """List of Polygon, surface frame, m."""
    @property
    def pieces(self) -> List[ConvexPiece]:
        """List of ConvexPiece, vertices in the world frame, m."""
    @property
    def polygons(self) -> List[Polygon]:
        """List of Polygon, surface frame, m."""
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, as JSON can hold them."""

class Polygon:
    """In a surface's frame, m; rings are simple and not closed.

    The last vertex of a ring differs from its first.
    """
    def __repr__(self) -> str: ...
    @property
    def holes(self) -> List[npt.NDArray[np.float64]]:
        """List of (M, 2) float64, clockwise; read-only views."""
    @property
    def outer(self) -> npt.NDArray[np.float64]:
        """(N, 2) float64, counter-clockwise seen from the normal's tip; a read-only view."""
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, as JSON can hold them."""

class PolygonEdges:
    """Labels of a Polygon's edges; edge k of a ring runs from vertex k to k + 1.

    "real": the surface ends; "occluded"; "sensor_limit"; "frontier": nobody has looked.
    """
    def __init__(self, outer: Sequence[str], holes: Sequence[Sequence[str]]) -> None:
        """Labels by ring."""
    def __repr__(self) -> str: ...
    @property
    def holes(self) -> List[List[str]]:
        """List of lists of labels."""
    @property
    def outer(self) -> List[str]:
        """List of labels."""
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, as JSON can hold them."""

class Quadruped:
    """A robot on four ball feet, which crawls; sizes of an ANYmal."""
    def __eq__(self, other: object) -> bool: ...
    def __init__(self, *, body: Union[BodyBox, Mapping[str, Any]] = ..., contact: Union[ContactLimits, Mapping[str, Any]] = ..., costs: Union[StepCosts, Mapping[str, Any]] = ..., foot: Union[ContactShape, Mapping[str, Any]] = ..., high_lift_m: float = ..., lift_m: float = ..., max_down_m: float = ..., max_sideward_m: float = ..., max_step_m: float = ..., max_sway_m: float = ..., max_turn_rad: float = ..., max_up_m: float = ..., reach_m: float = ..., snap_m: float = ..., stance_length_m: float = ..., stance_width_m: float = ..., support_margin_m: float = ...) -> None: ...
    def __repr__(self) -> str: ...
    @property
    def body(self) -> BodyBox:
        """BodyBox."""
    @body.setter
    def body(self, value: BodyBox) -> None: ...
    @property
    def contact(self) -> ContactLimits:
        """ContactLimits; `contact.up` tells which way is up."""
    @contact.setter
    def contact(self, value: ContactLimits) -> None: ...
    @property
    def costs(self) -> StepCosts:
        """StepCosts."""
    @costs.setter
    def costs(self, value: StepCosts) -> None: ...
    @property
    def foot(self) -> ContactShape:
        """ContactShape."""
    @foot.setter
    def foot(self, value: ContactShape) -> None: ...
    @staticmethod
    def from_dict(values: Dict[str, Any]) -> Quadruped:
        """Back from to_dict(); what is missing keeps its default. Throws Error(usage) for a name that is no field."""
    @property
    def high_lift_m(self) -> float:
        """m, where it would touch something so."""
    @high_lift_m.setter
    def high_lift_m(self, value: float) -> None: ...
    @property
    def lift_m(self) -> float:
        """m of the swinging foot over the higher of the two footholds beside it."""
    @lift_m.setter
    def lift_m(self, value: float) -> None: ...
    @staticmethod
    def limits() -> ContactLimits:
        """The ContactLimits it has unless told otherwise."""
    @property
    def max_down_m(self) -> float:
        """m, of a step."""
    @max_down_m.setter
    def max_down_m(self, value: float) -> None: ...
    @property
    def max_sideward_m(self) -> float:
        """m, likewise to a side, and back."""
    @max_sideward_m.setter
    def max_sideward_m(self, value: float) -> None: ...
    @property
    def max_step_m(self) -> float:
        """m by which the body advances while each foot steps once."""
    @max_step_m.setter
    def max_step_m(self, value: float) -> None: ...
    @property
    def max_sway_m(self) -> float:
        """m, of the body from its straight way."""
    @max_sway_m.setter
    def max_sway_m(self, value: float) -> None: ...
    @property
    def max_turn_rad(self) -> float:
        """rad, of a step."""
    @max_turn_rad.setter
    def max_turn_rad(self, value: float) -> None: ...
    @property
    def max_up_m(self) -> float:
        """m, of a step."""
    @max_up_m.setter
    def max_up_m(self, value: float) -> None: ...
    @property
    def reach_m(self) -> float:
        """m, level, of a foot from below its hip."""
    @reach_m.setter
    def reach_m(self, value: float) -> None: ...
    def replaced(self, *, body: Union[BodyBox, Mapping[str, Any]] = ..., contact: Union[ContactLimits, Mapping[str, Any]] = ..., costs: Union[StepCosts, Mapping[str, Any]] = ..., foot: Union[ContactShape, Mapping[str, Any]] = ..., high_lift_m: float = ..., lift_m: float = ..., max_down_m: float = ..., max_sideward_m: float = ..., max_step_m: float = ..., max_sway_m: float = ..., max_turn_rad: float = ..., max_up_m: float = ..., reach_m: float = ..., snap_m: float = ..., stance_length_m: float = ..., stance_width_m: float = ..., support_margin_m: float = ...) -> Quadruped:
        """A copy with the fields set that are given, by name as to the constructor."""
    @property
    def snap_m(self) -> float:
        """m from below its hip within which a foothold is looked for."""
    @snap_m.setter
    def snap_m(self, value: float) -> None: ...
    @property
    def stance_length_m(self) -> float:
        """m between its feet when it stands."""
    @stance_length_m.setter
    def stance_length_m(self, value: float) -> None: ...
    @property
    def stance_width_m(self) -> float:
        """m between its feet when it stands."""
    @stance_width_m.setter
    def stance_width_m(self, value: float) -> None: ...
    @property
    def support_margin_m(self) -> float:
        """m, of the body's middle inside the triangle of support."""
    @support_margin_m.setter
    def support_margin_m(self, value: float) -> None: ...
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, nested where they are settings themselves; as JSON can hold them."""
    def validate(self) -> None:
        """Throws Error(usage) naming field, value and rule."""

class RayHit:
    """Where a ray meets a surface."""
    def __repr__(self) -> str: ...
    @property
    def distance(self) -> float:
        """m."""
    @property
    def front(self) -> bool:
        """From the side the surface was seen from."""
    @property
    def id(self) -> int:
        """Of the surface."""
    @property
    def point(self) -> npt.NDArray[np.float64]:
        """(3,) float64, map frame, m, on its polygons; a view."""
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, as JSON can hold them."""

class Scan:
    """One posed scan, which owns its points; does not change."""
    @property
    def T_map_sensor(self) -> npt.NDArray[np.float64]:
        """(4, 4) float64, sensor frame to map frame; a copy."""
    def __init__(self, points: npt.ArrayLike, T_map_sensor: npt.ArrayLike, *, stamp_s: float = ..., sensor: str = ..., name: str = ...) -> None:
        """points: (..., 3), m, in the sensor's frame, copied as float32; what is not finite is "no reading".
        T_map_sensor: (4, 4), sensor frame to map frame, a rigid motion.
        stamp_s: when it was taken, s. sensor: "depth_camera" or "lidar", picks the default maximum range.
        name: for messages.
        """
    def __len__(self) -> int: ...
    def __repr__(self) -> str: ...
    @staticmethod
    def from_depth(depth: npt.ArrayLike, intrinsics: Any, T_map_camera: npt.ArrayLike, *, depth_scale: float = ..., stamp_s: float = ..., name: str = ...) -> Scan:
        """From a depth image of a pinhole camera without distortion; x right, y down, z along the optical axis.

        depth: (H, W) uint16 with `depth_scale` units per metre, 0 and 65535 for no reading; or float32 or float64 in metres,
        0, negative and not finite for no reading (`depth_scale` is not used).
        intrinsics: (fx, fy, cx, cy) or K, (3, 3); pixels. T_map_camera: (4, 4), camera frame to map frame.
        """
    @property
    def name(self) -> str:
        """File or index."""
    @property
    def noise(self) -> List[Tuple[int, int, int]]:
        """List of (class of distance, class of size, count) of their differences, likewise."""
    @property
    def points(self) -> npt.NDArray[np.float32]:
        """(N, 3) float32, sensor frame, m; a read-only view."""
    @property
    def readings(self) -> List[int]:
        """List of how many readings each point is the mean of, in a scan of an archive; else empty."""
    @property
    def sensor(self) -> str:
        """"depth_camera" or "lidar"."""
    @property
    def shared_variances(self) -> List[Tuple[int, float]]:
        """List of (class of distance, m2) that readings have in common, likewise."""
    @property
    def stamp_s(self) -> float:
        """s."""
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, as JSON can hold them."""
    def with_pose(self, T_map_sensor: npt.ArrayLike) -> Scan:
        """A copy of it at another pose, (4, 4)."""

class ScanReport:
    """What one scan did."""
    def __repr__(self) -> str: ...
    @property
    def added(self) -> int:
        """New inliers of surfaces there before, inside them or at their rims."""
    @property
    def alignment(self) -> Alignment:
        """Alignment; its T_map_sensor is what the scan was inserted with."""
    @property
    def appeared(self) -> int:
        """Voxels that became occupied."""
    @property
    def born(self) -> List[int]:
        """Surface ids."""
    @property
    def categorized(self) -> int:
        """Of the appeared, in a surface when insert() returned."""
    @property
    def detected(self) -> int:
        """The same, given to them by detection."""
    @property
    def expanded(self) -> int:
        """The same, over their boundaries."""
    @property
    def gone(self) -> List[int]:
        """Surface ids."""
    @property
    def grown(self) -> List[int]:
        """Surface ids."""
    @property
    def merged(self) -> List[int]:
        """Surface ids."""
    @property
    def points_beyond_range(self) -> int:
        """Not mapped, but free space up to max_range."""
    @property
    def points_not_finite(self) -> int:
        """No reading."""
    @property
    def points_out_of_map(self) -> int:
        """Dropped: outside the octree."""
    @property
    def points_raw(self) -> int:
        """Handed in."""
    @property
    def points_too_near(self) -> int:
        """Dropped: nearer than min_range."""
    @property
    def shrunk(self) -> List[int]:
        """Surface ids."""
    @property
    def stage_ms(self) -> Dict[str, float]:
        """dict of ms by stage: align, downsample, occupancy, …"""
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, as JSON can hold them."""
    @property
    def total_ms(self) -> float:
        """ms."""
    @property
    def vanished(self) -> int:
        """Voxels that no longer are."""
    @property
    def voxels(self) -> int:
        """Distinct end voxels."""
    @property
    def waiting(self) -> int:
        """New points in blocks whose turn has not come: Mapper.drain()."""

class ScanSource:
    """Posed scans, one after the other, decoded as they are asked for."""
    def __iter__(self) -> Iterator[Scan]: ...
    def __len__(self) -> int:
        """Number of scans listed, bad ones included."""
    def __next__(self) -> Scan:
        """Throws Error(data) with its name for a scan that cannot be read."""
    def __repr__(self) -> str: ...
    def notes(self) -> List[str]:
        """What was chosen among what the recording has, a line each."""
    def skipped(self) -> List[str]:
        """A line for every scan that was left out so far, and why."""

class SnappedPose:
    """A pose laid on a surface."""
    @property
    def T_map_pose(self) -> npt.NDArray[np.float64]:
        """(4, 4) float64, its z along the normal; a copy."""
    def __repr__(self) -> str: ...
    @property
    def id(self) -> int:
        """Of the surface."""
    @property
    def moved_m(self) -> float:
        """m, by which its origin moved."""
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, as JSON can hold them."""
    @property
    def turned_rad(self) -> float:
        """rad, by which it turned."""

class Snapshot:
    """A consistent view of all surfaces at one revision; never changes, cheap to keep."""
    def __len__(self) -> int: ...
    def __repr__(self) -> str: ...
    def changed_since(self, revision: int) -> List[Surface]:
        """List of the Surfaces changed after `revision`."""
    @property
    def cylinders(self) -> List[Cylinder]:
        """List of Cylinder, ascending id."""
    def departures(self, since: int = ...) -> List[Departure]:
        """List of Departure after revision `since`, oldest first."""
    def find(self, id: int) -> Surface:
        """The Surface of this id, or None."""
    def find_cylinder(self, id: int) -> Cylinder:
        """The Cylinder of this id, or None."""
    @property
    def octree(self) -> OccupancyView:
        """OccupancyView of the same scan; knows nothing unless Mapper.share_octree() was called before."""
    @property
    def resolution(self) -> float:
        """d of the map, m."""
    @property
    def revision(self) -> int:
        """Of the map."""
    @property
    def surfaces(self) -> List[Surface]:
        """List of Surface, ascending id."""
    def up(self) -> npt.NDArray[np.float64]:
        """(3,) float64, unit: up in its map, as the parameters give it or, where they leave it open, estimated.

        The estimate is up_of(map)'s, made anew each time: O(n^2) in surfaces, a few ns each.
        """

class Standing:
    """Where a robot stands."""
    def __eq__(self, other: object) -> bool: ...
    def __init__(self, *, at: npt.ArrayLike = ..., yaw_rad: float = ...) -> None: ...
    def __repr__(self) -> str: ...
    @property
    def at(self) -> npt.NDArray[np.float64]:
        """(3,) float64, map frame, m: the ground between its feet; a view."""
    @at.setter
    def at(self, value: npt.ArrayLike) -> None: ...
    @staticmethod
    def from_dict(values: Dict[str, Any]) -> Standing:
        """Back from to_dict(); what is missing keeps its default. Throws Error(usage) for a name that is no field."""
    def replaced(self, *, at: npt.ArrayLike = ..., yaw_rad: float = ...) -> Standing:
        """A copy with the fields set that are given, by name as to the constructor."""
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, nested where they are settings themselves; as JSON can hold them."""
    @property
    def yaw_rad(self) -> float:
        """rad: its heading about up, counter-clockwise from the map's x axis."""
    @yaw_rad.setter
    def yaw_rad(self, value: float) -> None: ...

class StepCosts:
    """What is dear in a step besides that it is one, which costs 1."""
    def __eq__(self, other: object) -> bool: ...
    def __init__(self, *, good_margin_m: float = ..., height: float = ..., length: float = ..., margin: float = ..., slope: float = ..., turn: float = ..., uncertain_m: float = ..., uncertainty: float = ...) -> None: ...
    def __repr__(self) -> str: ...
    @staticmethod
    def from_dict(values: Dict[str, Any]) -> StepCosts:
        """Back from to_dict(); what is missing keeps its default. Throws Error(usage) for a name that is no field."""
    @property
    def good_margin_m(self) -> float:
        """m."""
    @good_margin_m.setter
    def good_margin_m(self, value: float) -> None: ...
    @property
    def height(self) -> float:
        """Of the highest."""
    @height.setter
    def height(self, value: float) -> None: ...
    @property
    def length(self) -> float:
        """Of the longest step; in proportion for shorter ones."""
    @length.setter
    def length(self, value: float) -> None: ...
    @property
    def margin(self) -> float:
        """On an edge; nothing from good_margin_m on."""
    @margin.setter
    def margin(self, value: float) -> None: ...
    def replaced(self, *, good_margin_m: float = ..., height: float = ..., length: float = ..., margin: float = ..., slope: float = ..., turn: float = ..., uncertain_m: float = ..., uncertainty: float = ...) -> StepCosts:
        """A copy with the fields set that are given, by name as to the constructor."""
    @property
    def slope(self) -> float:
        """On the steepest slope."""
    @slope.setter
    def slope(self, value: float) -> None: ...
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, nested where they are settings themselves; as JSON can hold them."""
    @property
    def turn(self) -> float:
        """Of the widest turn."""
    @turn.setter
    def turn(self, value: float) -> None: ...
    @property
    def uncertain_m(self) -> float:
        """m."""
    @uncertain_m.setter
    def uncertain_m(self, value: float) -> None: ...
    @property
    def uncertainty(self) -> float:
        """On a plane that may be uncertain_m off."""
    @uncertainty.setter
    def uncertainty(self, value: float) -> None: ...

class Surface:
    """One contact surface as a planner sees it. Immutable; lives as long as anything of it is held."""
    @property
    def T_map_surface(self) -> npt.NDArray[np.float64]:
        """(4, 4) float64, surface frame to map frame: z is the normal, the origin on the plane; a copy."""
    def __repr__(self) -> str: ...
    @property
    def area_m2(self) -> float:
        """m2, of `polygons`."""
    @property
    def born(self) -> int:
        """Map revision in which it appeared; 0: before maps noted that."""
    @property
    def boundary(self) -> npt.NDArray[np.float64]:
        """(N, 3) float64, map frame, m: the rings' vertices, neighbours at most h apart; a read-only view."""
    def circles(self, min_radius: float) -> List[Circle]:
        """Overlapping circles of at least `min_radius` m that fill the simplified polygons, largest first."""
    @property
    def color(self) -> List[float]:
        """(r, g, b) in [0, 1], distinct by construction."""
    def convex_pieces(self) -> List[ConvexPiece]:
        """The simplified polygons cut into convex pieces: a list of ConvexPiece that cover them, none overlapping."""
    @property
    def covariance(self) -> npt.NDArray[np.float64]:
        """(3, 3) float64, a read-only view: how sure the plane is, in the surface's frame at its origin.

        The true plane is off = c + a u + b v there; this is the covariance of (a [rad], b [rad], c [m]). It does not know the
        poses' errors, nor what readings have in common.
        """
    def extrude(self, thickness: float) -> Mesh:
        """The polygons extruded by `thickness` m against the normal: a closed Mesh, map frame."""
    @property
    def id(self) -> int:
        """1 to 2**24 - 1, never reused."""
    @property
    def inliers(self) -> int:
        """Voxels."""
    def normal_std_rad(self) -> float:
        """Of the normal's tilt where it is least sure, rad."""
    def offset_std_m(self) -> float:
        """Of the plane's height at the frame's origin, m."""
    @property
    def parents(self) -> List[int]:
        """Ids merged into this one, or the one it was split from."""
    @property
    def plane(self) -> Plane:
        """Plane, map frame."""
    @property
    def polygons(self) -> List[Polygon]:
        """List of Polygon: alpha shape of the inliers, in the surface's frame (u, v), m."""
    @property
    def resolution(self) -> float:
        """d of the map, m."""
    @property
    def revision(self) -> int:
        """Map revision of the last change."""
    @property
    def rms_m(self) -> float:
        """m, of the inliers' distances to the plane."""
    def simplified(self) -> List[Polygon]:
        """The polygons without near-collinear vertices: a list of Polygon whose outlines moved by d/2 at most."""
    def slope_rad(self, up: Optional[npt.ArrayLike] = ...) -> float:
        """Angle between normal and up, rad: 0 a floor, pi/2 a wall.

        up: (3,), map frame; None: what the map's parameters give. Throws Error(usage) where they leave it open, and for a surface
        out of a pickle: give snapshot.up().
        """
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, as JSON can hold them."""
    def to_map(self, uv: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """(..., 3) float64, map frame, of points (u, v) of its own, (..., 2), m; a row for each."""

class SurfaceDifference:
    """A surface of one of two maps, and how much of it the other map has, too."""
    def __repr__(self) -> str: ...
    @property
    def angle_rad(self) -> float:
        """rad, between the normals."""
    @property
    def area_m2(self) -> float:
        """m2, of its polygons."""
    @property
    def free_m2(self) -> float:
        """m2 of the rest, in space that the other map's octree has seen free: it is gone."""
    @property
    def id(self) -> int:
        """Of the surface."""
    @property
    def offset_m(self) -> float:
        """m, of `other` from it along its normal."""
    @property
    def other(self) -> int:
        """Id of the other map's that holds most of it; 0: none."""
    @property
    def shared_m2(self) -> float:
        """m2 of that, over or under a polygon of the other map's."""
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, as JSON can hold them."""
    @property
    def unseen_m2(self) -> float:
        """m2 of the rest, in space that the other map has not seen."""

class SurfaceIndex:
    """A snapshot's surfaces, ordered by place for questions that are asked often.

    Immutable: every thread may ask. All in the map frame, m; of surfaces that are as near the lower id wins. up: (3,), map
    frame; None: Snapshot.up(). Throws Error(usage) for points that are not finite.
    """
    def __init__(self, snapshot: Snapshot, previous: SurfaceIndex = ...) -> None:
        """previous: of an earlier snapshot, from which what has not changed is taken over."""
    def __repr__(self) -> str: ...
    def below(self, point: npt.ArrayLike, *, up: Optional[npt.ArrayLike] = ..., max_slope_rad: float = ...) -> Optional[Nearest]:
        """The place straight below a point, against `up`, where a surface is met first; or None."""
    def first_on_ray(self, from_: npt.ArrayLike, direction: npt.ArrayLike, *, within: float = ...) -> Optional[RayHit]:
        """RayHit of the first surface along a ray, from either side, at most `within` m away; or None."""
    def in_sphere(self, center: npt.ArrayLike, radius: float) -> List[int]:
        """Likewise of a sphere, m."""
    def inside(self, space: ConvexSpace) -> List[int]:
        """Ids, ascending, of the surfaces of which any point lies in a ConvexSpace."""
    def nearest(self, point: npt.ArrayLike, *, up: Optional[npt.ArrayLike] = ..., max_slope_rad: float = ..., within: float = ...) -> Optional[Nearest]:
        """Nearest to `point`, (3,), or None; among surfaces that slope to `up` by max_slope_rad at most, within m."""
    def snap(self, T_map_pose: npt.ArrayLike, *, up: Optional[npt.ArrayLike] = ..., max_slope_rad: float = ..., within: float = ...) -> Optional[SnappedPose]:
        """SnappedPose: the pose, (4, 4), moved to the nearest such surface, its z turned to the normal; or None."""
    def surface_of_voxel(self, point: npt.ArrayLike) -> int:
        """Id of the surface that the voxel at `point` belongs to, by the snapshot's octree; 0: none, or no octree."""

class SurfaceParameters:
    """What belongs to a surface and what is derived from it."""
    def __eq__(self, other: object) -> bool: ...
    def __init__(self, *, max_hole_size: Optional[float] = ..., mesh_thickness: float = ..., min_surface_width: float = ..., range_noise: Optional[float] = ..., sensor_noise: float = ..., surface_tolerance: Optional[float] = ...) -> None: ...
    def __repr__(self) -> str: ...
    @staticmethod
    def from_dict(values: Dict[str, Any]) -> SurfaceParameters:
        """Back from to_dict(); what is missing keeps its default. Throws Error(usage) for a name that is no field."""
    @property
    def max_hole_size(self) -> Optional[float]:
        """h, m: alpha of the alpha shape, expansion reach, cluster gap; None: derived."""
    @max_hole_size.setter
    def max_hole_size(self, value: Optional[float]) -> None: ...
    @property
    def mesh_thickness(self) -> float:
        """m: extrusion against the normal."""
    @mesh_thickness.setter
    def mesh_thickness(self, value: float) -> None: ...
    @property
    def min_surface_width(self) -> float:
        """m: narrower clusters stay pending; 0: any."""
    @min_surface_width.setter
    def min_surface_width(self, value: float) -> None: ...
    @property
    def range_noise(self) -> Optional[float]:
        """1/m: sigma(z) = sensor_noise + range_noise z^2; None: estimated from the scans."""
    @range_noise.setter
    def range_noise(self, value: Optional[float]) -> None: ...
    def replaced(self, *, max_hole_size: Optional[float] = ..., mesh_thickness: float = ..., min_surface_width: float = ..., range_noise: Optional[float] = ..., sensor_noise: float = ..., surface_tolerance: Optional[float] = ...) -> SurfaceParameters:
        """A copy with the fields set that are given, by name as to the constructor."""
    @property
    def sensor_noise(self) -> float:
        """m: standard deviation near the sensor."""
    @sensor_noise.setter
    def sensor_noise(self, value: float) -> None: ...
    @property
    def surface_tolerance(self) -> Optional[float]:
        """s, m: reach of a plane; None: derived."""
    @surface_tolerance.setter
    def surface_tolerance(self, value: Optional[float]) -> None: ...
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, nested where they are settings themselves; as JSON can hold them."""

class Up:
    """Which way is up in a map, and how that is known."""
    def __repr__(self) -> str: ...
    @property
    def direction(self) -> npt.NDArray[np.float64]:
        """(3,) float64, unit, map frame; a view."""
    @property
    def level_m2(self) -> float:
        """m2, of an estimate: area of the surfaces level to it."""
    @property
    def rival(self) -> float:
        """Of an estimate: the score of the best other direction over this one's; at 1 give the direction."""
    @property
    def source(self) -> str:
        """"given" (Parameters.up), "surfaces" (an estimate) or "assumed" (+z, there is no surface)."""
    def to_dict(self) -> Dict[str, Any]:
        """The fields by name, as JSON can hold them."""

def align(map: Snapshot, scan: Scan, *, translation_m: float = ..., rotation_rad: float = ...) -> Alignment:
    """Localizer(map, …).localize(scan), for a single scan."""

def align_maps(map: Snapshot, other: Map, T_map_other: npt.ArrayLike = ..., *, translation_m: float = ..., rotation_rad: float = ...) -> MapAlignment:
    """MapAlignment of another Map with a Snapshot's surfaces, from a guess so far off at most: m, rad.

    For Mapper.merge(). Throws Error(data) if the pose is not rigid.
    """

def below(snapshot: Snapshot, point: npt.ArrayLike, *, up: Optional[npt.ArrayLike] = ..., max_slope_rad: float = ...) -> Optional[Nearest]:
    """SurfaceIndex.below() likewise."""

def changes_since(snapshot: Snapshot, since: int) -> MapChanges:
    """MapChanges: everything that happened after revision `since`, over any number of scans.

    Who drops `gone` and every `before` of `merged`, and reads `appeared` and `changed` anew, has what the snapshot has.
    Throws Error(usage) for a revision to come.
    """

def compare_maps(before: Snapshot, after: Snapshot, tolerance: float = ...) -> MapDifference:
    """MapDifference of two Snapshots of one place as they lie, whatever their ids.

    tolerance: m that a surface may lie over or under the other map's; 0: twice the coarser d.
    """

def contact_region(surface: Surface, shape: ContactShape, yaw_rad: Optional[float] = ..., limits: Optional[ContactLimits] = ..., *, octree: Optional[OccupancyView] = ..., edges: Optional[Sequence[PolygonEdges]] = ..., others: Optional[Snapshot] = ...) -> ContactRegion:
    """ContactRegion of a Surface for one heading, rad counter-clockwise from the map's x axis, or None for all.

    limits: None: ContactLimits() with up as Surface.slope_rad() has it.
    octree: OccupancyView, asked for obstacles, clearance and gaps. edges: label_edges() of the surface, for a frontier margin.
    others: Snapshot of the octree's scan; what stands there is then where its surfaces' planes are, not all over their voxels.
    Safe: a contact at any point of it lies on the surface. Throws Error(usage) for limits that make no sense or miss what they
    need.
    """

def convex_pieces(surface: Surface, region: ContactRegion, most: int, min_area_m2: float = ...) -> List[ConvexPiece]:
    """At most `most` disjoint convex pieces inside a ContactRegion, the largest first: a list of ConvexPiece.

    They cover as much of it as they can. Surface.convex_pieces() covers all of a surface's polygons instead.
    """

def double_layers(snapshot: Snapshot, *, max_angle_rad: float = ..., max_distance_m: float = ..., min_overlap: float = ...) -> List[DoubleLayer]:
    """List of DoubleLayer: pairs that overlap, by that share of the smaller, though nearly parallel and near."""

def explain(map: Map, point: npt.ArrayLike) -> Explanation:
    """Explanation: why is there no surface at `point`, (3,), map frame, m? Throws Error(usage) if it is not finite."""

def export_grid_map(grid: HeightGrid, frame: str, file: Union[str, os.PathLike[str]], force: bool = ...) -> None:
    """grid_map_msgs/GridMap of a HeightGrid as .json or .cdr."""

def export_height_image(grid: HeightGrid, file: Union[str, os.PathLike[str]], force: bool = ...) -> None:
    """A HeightGrid as 16-bit grey PNG, and beside it a .json that says what its values mean."""

def export_hpp(surfaces: Sequence[PlannerSurface], folder: Union[str, os.PathLike[str]], force: bool = ...) -> int:
    """A folder of binary STL, one for each piece, for hpp-affordance; returns how many."""

def export_ihmc(regions: Sequence[IhmcRegion], folder: Union[str, os.PathLike[str]], force: bool = ...) -> None:
    """A folder of IHMC's PlanarRegionFileTools, version 2."""

def export_planar_terrain(surfaces: Sequence[PlannerSurface], grid: HeightGrid, frame: str, file: Union[str, os.PathLike[str]], force: bool = ...) -> PlanarTerrainCount:
    """convex_plane_decomposition_msgs/PlanarTerrain as .json or .cdr: a PlanarTerrainCount."""

def export_sl1m(surfaces: Sequence[PlannerSurface], file: Union[str, os.PathLike[str]], force: bool = ...) -> None:
    """Writes the pieces of a list of PlannerSurface as SL1M and its kin take them: docs/formats.md, section 7.

    As all of these: throws Error(usage) for a file that exists unless `force`, Error(data) if there is nothing to write,
    Error(output).
    """

def export_surfaces(snapshot: Snapshot, file: Union[str, os.PathLike[str]], *, parts: Sequence[str] = ..., mesh_thickness: float = ..., up: Optional[npt.ArrayLike] = ..., force: bool = ..., convex: Mapping[int, Sequence[ConvexPiece]] = ..., circles: Mapping[int, Sequence[Circle]] = ..., points: Any = ..., edges: Mapping[int, Sequence[PolygonEdges]] = ...) -> None:
    """Writes the surfaces in the format the file's ending names: .json, .ply, .glb, .obj, .stl, .csv.

    parts: "polygons", "meshes", "convex", "circles", "points"; .json takes any number, others exactly one.
    convex, circles: by surface id, for those parts. points: an array as Map.points() gives it, likewise.
    edges: label_edges() by surface id, go into .json. mesh_thickness: m. up: (3,), map frame; None: snapshot.up(). force: write over a file that exists.
    Map frame, m. The file is complete or not there. Throws Error(usage, data, output).
    """

def foothold(surface: Surface, shape: ContactShape, at: npt.ArrayLike, yaw_rad: float, limits: Optional[ContactLimits] = ..., *, octree: Optional[OccupancyView] = ..., edges: Optional[Sequence[PolygonEdges]] = ..., others: Optional[Snapshot] = ...) -> Foothold:
    """Foothold: judges a contact whose reference point stands at `at`, (3,), map frame, projected onto the plane."""

def heading_on(surface: Surface, yaw_rad: float, up: Optional[npt.ArrayLike] = ...) -> npt.NDArray[np.float64]:
    """(2,) float64: where a contact's x axis points in the surface's frame, for a heading about `up`, rad; None: as Surface.slope_rad() has it."""

def height_grid(snapshot: Snapshot, *, cell: float = ..., up: Optional[npt.ArrayLike] = ..., max_slope_rad: float = ..., below: Optional[float] = ...) -> HeightGrid:
    """HeightGrid: the highest surface at each cell's centre, in the map turned so that `up` is +z.

    up: (3,), map frame; None: snapshot.up().
    cell: m; 0: the map's resolution. Surfaces steeper than max_slope_rad and what is higher than `below` m are left out.
    """

def ihmc_regions(surface: PlannerSurface) -> List[IhmcRegion]:
    """List of IhmcRegion: one for each polygon of a PlannerSurface, with those of its pieces that lie in it."""

def label_edges(map: Map, surface: Surface) -> List[PolygonEdges]:
    """List of PolygonEdges, one for each polygon of a Surface of the map's present snapshot."""

def load(stem: Union[str, os.PathLike[str]]) -> Map:
    """The Map of `stem`.surfaces, such as octosurf.load("maps/office").

    Throws Error(data) for damaged or foreign files; warns (UserWarning) where, say, the .bt beside it does not match.
    """

def map_from_leaves(leaves: npt.ArrayLike, parameters: Parameters = ...) -> Map:
    """The same from leaves as OccupancyView.leaves() gives them, on the grid of the parameters' resolution."""

def map_from_octomap(file: Union[str, os.PathLike[str]], parameters: Parameters = ...) -> Map:
    """Map of the octree of an OctoMap file (.bt, .ot), as yet without points: see Mapper.detect_in_occupancy().

    The file's resolution replaces the parameters'. Throws Error(data, usage).
    """

def nearest(snapshot: Snapshot, point: npt.ArrayLike, *, up: Optional[npt.ArrayLike] = ..., max_slope_rad: float = ...) -> Optional[Nearest]:
    """SurfaceIndex.nearest() without an index: looks at every surface."""

def open_scans(inputs: Union[Union[str, os.PathLike[str]], Sequence[Union[str, os.PathLike[str]]]], *, poses: Optional[Union[str, os.PathLike[str]]] = ..., intrinsics: Optional[Union[str, os.PathLike[str]]] = ..., depth_scale: Optional[float] = ..., rate_hz: Optional[float] = ..., max_pose_gap_s: Optional[float] = ..., topics: Sequence[str] = ..., pose_topic: Optional[str] = ..., pose_frame: Optional[str] = ..., fixed_frame: Optional[str] = ..., info_topic: Optional[str] = ..., skip_bad: bool = ...) -> ScanSource:
    """Opens a recording, or a list of them, one after the other: what `octosurf map` reads.

    7-Scenes, TUM RGB-D and KITTI folders, 16-bit depth images (PNG, PGM), PCD, PLY, OctoMap's .graph, archives of scans,
    bags of ROS 1 (.bag) and ROS 2 (.db3, .mcap, or their folder).
    poses: a file with one pose per scan, or a stamped trajectory; wins over what lies beside the scans.
    intrinsics: a file with K or `fx fy cx cy`. depth_scale: units per metre; None: 5000 for TUM folders, else 1000.
    rate_hz: of scans without time stamps; None: 30 for depth cameras, 10 for lidar.
    max_pose_gap_s: a pose is interpolated between neighbours at most so far apart; None: 0.1, and 0.25 in bags.
    Of bags: topics, of clouds or depth images; pose_topic, instead of tf, and pose_frame, whose poses those are; fixed_frame,
    the map's in tf; info_topic, CameraInfo. What is not given is chosen where there is no choice, see notes().
    skip_bad: go on after a scan that cannot be read or whose pose is not a rigid motion.
    Throws Error(usage, data).
    """

def plan(snapshot: Snapshot, from_: Standing, to: Standing, robot: Optional[Union[Biped, Quadruped]] = ..., budget: PlanBudget = ..., *, octree: Optional[OccupancyView] = ..., edges: Mapping[int, Sequence[PolygonEdges]] = ...) -> FootstepPlan:
    """FootstepPlanner(snapshot, robot, …).plan(from_, to, budget), for a single plan."""

def read_ihmc(folder: Union[str, os.PathLike[str]]) -> List[IhmcRegion]:
    """List of IhmcRegion of such a folder, version 1 or 2. Throws Error(data)."""

def read_octomap_resolution(file: Union[str, os.PathLike[str]]) -> float:
    """Resolution of an OctoMap file (.bt, .ot), m. Throws Error(data)."""

def render_png(snapshot: Snapshot, file: Union[str, os.PathLike[str]], *, width: int = ..., height: int = ..., view: str = ..., up: Optional[npt.ArrayLike] = ..., eye: Optional[npt.ArrayLike] = ..., target: Optional[npt.ArrayLike] = ..., cut: bool = ..., edges: Mapping[int, Sequence[PolygonEdges]] = ..., force: bool = ...) -> None:
    """Renders the surfaces' polygons as a PNG of so many pixels.

    view: "iso", "top", "front", "back", "left", "right"; or eye and target, (3,), map frame, m.
    up: (3,), map frame; None: snapshot.up(). cut: leave out surfaces seen from behind. edges: drawn in their kind's colour. Throws Error(usage, data, output).
    """

def save(map: Map, stem: Union[str, os.PathLike[str]]) -> None:
    """Writes `stem`.surfaces (everything) and `stem`.bt (plain OctoMap) over what is there.

    Whenever that fails, the files of before or the new ones are there. An archive of scans (`octosurf map --keep-scans`) that
    the map had is not told in them: it has not got what Python inserted. Throws Error(output), Error(incomplete).
    """

def up_of(map: Map) -> Up:
    """The Up that the map's parameters give or, where they leave it open, that its surfaces tell."""

def verify_plan(plan: FootstepPlan, snapshot: Snapshot, robot: Union[Biped, Quadruped], *, octree: Optional[OccupancyView] = ..., edges: Mapping[int, Sequence[PolygonEdges]] = ...) -> List[str]:
    """Judges every step anew, without the planner's tables: a sentence for each that is wrong; none if all is well."""
