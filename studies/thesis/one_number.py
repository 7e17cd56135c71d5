"""Figures of claims that are not met, as functions of one number of the machine.

python studies/thesis/one_number.py --only I9 --out experiments
"""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[2]))

from rotorsim.cli import main
from rotorsim.commands.registry import single

if __name__ == "__main__":
    from studies.thesis.commands import one_number

    main(app=single(one_number))
