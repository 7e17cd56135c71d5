from fe_shaft import ShaftError as ShaftError
from identification import (
    ExtrapolationWarning as ExtrapolationWarning,
    ModelError as ModelError,
    ReadError as ReadError,
    SchemaError as SchemaError,
    UnfitError as UnfitError,
)
from reynolds import FilmError as FilmError
from rotorsim.base.errors import (
    ContactError as ContactError,
    ControllerError as ControllerError,
    ConvergenceError as ConvergenceError,
    DataError as DataError,
    DesignError as DesignError,
    LawError as LawError,
    LimitError as LimitError,
    MachineFileError as MachineFileError,
    NoCache as NoCache,
    NoLiftOffError as NoLiftOffError,
    NotCarried as NotCarried,
    OtherMachine as OtherMachine,
    PackageLeftOut as PackageLeftOut,
    RotorsimError as RotorsimError,
    UnstableLaw as UnstableLaw,
    Unusual as Unusual,
)
from rotorsim.base.files import WriteError as WriteError
from rotorsim.campaign.axes import PlanError as PlanError
from rotorsim.campaign.scheduler import ClusterError as ClusterError
from rotorsim.campaign.store import StoreError as StoreError
from rotorsim.signals.record_blocks import MissingError as MissingError
