from tcrctl.api.recorded import Run as Run
from tcrctl.api.recorded import load as load
from tcrctl.api.running import Simulation as Simulation
from tcrctl.api.running import run as run
from tcrctl.api.running import simulate as simulate

__version__: str
