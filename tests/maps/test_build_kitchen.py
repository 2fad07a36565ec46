"""A real hand-held walk, a few frames of it, from the camera's files to an opened map."""

from pathlib import Path

import numpy as np
import pytest

from avlmaps.maps.build import build_map
from avlmaps.maps.settings import BuildSettings, FrameSettings
from avlmaps.maps.store.map_data import MapData, describe
from avlmaps.perception.encoders import Encoders, register_profile
