from .page.scene import Scene as Scene, load_scene as load_scene
from .replay import Replay as Replay
from .rig.laws import read_laws as read_laws
from .rig.rig import Rig as Rig
from .runner import Runner as Runner
from .serving import serve_rig as serve_rig
