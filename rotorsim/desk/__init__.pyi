from .design import Design as Design, open_design as open_design
from .panels import DesignCase as DesignCase, DeskPoint as DeskPoint, answer as answer
from .server import serve_desk as serve_desk
