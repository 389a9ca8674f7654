"""Force and stress from stereo endoscope video.

Lengths in mm of the left camera frame (x right, y down, z forward), forces in N of the instrument on the tissue, stress in
kPa. Arrays that results hand out are read-only views: copy what is to be changed.
"""

from palpate import _core
from palpate._core import (
    AttachmentOptions,
    BadInput,
    ContactOptions,
    ForceBand,
    ForceEstimate,
    ForceEstimator,
    ForceUncertainty,
    InferenceParameters,
    InstrumentOptions,
    MapOptions,
    MapReport,
    PointCloud,
    Recording,
    RecordingOptions,
    Rectification,
    Scene,
    StereoFrame,
    StereoRig,
    Surface,
    TetMesh,
    TissueMap,
    TissueOptions,
    UncertaintyOptions,
    Unfinished,
    build_tissue_map,
    force_uncertainty,
    make_rectification,
    read_rig,
    tetrahedralize,
)
from palpate._meshio import from_meshio, to_meshio

__version__ = _core.__version__
__all__ = [
    "AttachmentOptions",
    "BadInput",
    "ContactOptions",
    "ForceBand",
    "ForceEstimate",
    "ForceEstimator",
    "ForceUncertainty",
    "InferenceParameters",
    "InstrumentOptions",
    "MapOptions",
    "MapReport",
    "PointCloud",
    "Recording",
    "RecordingOptions",
    "Rectification",
    "Scene",
    "StereoFrame",
    "StereoRig",
    "Surface",
    "TetMesh",
    "TissueMap",
    "TissueOptions",
    "UncertaintyOptions",
    "Unfinished",
    "build_tissue_map",
    "force_uncertainty",
    "from_meshio",
    "make_rectification",
    "read_rig",
    "tetrahedralize",
    "to_meshio",
]
