from .rig.desk import Scene as Scene, load_scene as load_scene
from .rig.laws import read_laws as read_laws
from .rig.records import Replay as Replay
from .rig.rig import Rig as Rig
from .rig.runner import Runner as Runner
from .serving import serve_rig as serve_rig
