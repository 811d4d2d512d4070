"""meshcat scenes in a notebook without a server, a port or a network: live, as one offline HTML file, as a picture.

`Scene` has meshcat-python's own interface (`scene["a/b"].set_object(...)`) and is what a cell shows. `MujocoView` and
`PinocchioView` put a robot into a scene and move it; `play` gives it a motion with play button and time slider.
$TUTORIALBOT_VIEWER = "html" or "png" shows every scene as an offline page or as a picture instead of live;
`python3 -m tutorialbot run` uses it.
"""

from tutorialbot.viewers.scene import Scene
from tutorialbot.viewers.views import MujocoView, PinocchioView, play

__all__ = ["MujocoView", "PinocchioView", "Scene", "play"]
