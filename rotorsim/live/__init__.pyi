from .folder import Scene as Scene, load_scene as load_scene
from .laws import read_laws as read_laws
from .records import Replay as Replay
from .rig import Rig as Rig
from .runner import Runner as Runner
from .serving import serve_rig as serve_rig
