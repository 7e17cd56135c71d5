"""The whole circle: campaign, identification, designs, verification, and a verdict on every claim of the thesis.

python studies/thesis/whole.py --out study
"""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[2]))

from rotorsim.cli import main
from rotorsim.commands.registry import single

if __name__ == "__main__":
    from studies.thesis.commands import whole

    main(app=single(whole))
