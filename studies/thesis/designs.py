"""Every controller of the thesis on one identified model, verified on the nonlinear plant.

python studies/thesis/designs.py model_2.json --out control
"""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[2]))

from rotorsim.cli import main
from rotorsim.commands.registry import single

if __name__ == "__main__":
    from studies.thesis.commands import designs

    main(app=single(designs))
