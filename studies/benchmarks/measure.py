"""Speed and accuracy of the installed software, measured on this computer.

python studies/benchmarks/measure.py speed
"""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[2]))

from rotorsim.cli import main
from rotorsim.commands.registry import single

if __name__ == "__main__":
    from studies.benchmarks.command import bench

    main(app=single(bench))
