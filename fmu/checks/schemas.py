"""Validation against the official XML schemas of FMI 2.0, FMI 3.0 and SSP 1.0, as shipped with FMPy.

Not covered: the layered standard of the stored reference (fmi-ls-ref) is published without a schema, so of its files
only the manifest's attributes are checked, by FMI 3.0's own schema of manifests.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from fmu.checks.importer import fmpy
from fmu.info import xml
from rotorsim.base.errors import DataError
from rotorsim.base.exchange.archive import ArchiveError, read_archive

TERMINALS = "terminalsAndIcons/terminalsAndIcons.xml"
MANIFEST = "fmi-ls-manifest.xml"
VALUES = "ssp/schema/SystemStructureParameterValues.xsd"
VALUES_ROOT = "{http://ssp-standard.org/SSP1/SystemStructureParameterValues}ParameterSet"
"""The schema of systems lets anything stand where the values of parameters are."""
LS_ROOT = "{http://fmi-standard.org/fmi-ls-manifest}fmiLayeredStandardManifest"


def findings(path: str | Path) -> list[str]:
    """Violations of the official schemas in a .fmu or .ssp file, and in the units of the latter, one sentence each.

    Raises DataError for what is no archive, or one that is not read.
    """
    try:
        return list(_archive(Path(path).read_bytes(), ""))
    except ArchiveError as error:
        raise DataError(f"{path}: {error}") from error


def _archive(content: bytes, where: str) -> Iterator[str]:
    for name, file in read_archive(content).items():
        schema = _schema(name, file)
        if schema:
            yield from _violations(file, schema, where + name)
        elif name.endswith(".fmu") and not where:  # a unit holds no units
            yield from _archive(file, f"{name}: ")


def _schema(name: str, content: bytes) -> str | None:
    """File of the schema below FMPy's folder, None for a file that has none."""
    if name == "modelDescription.xml":
        version = b'fmiVersion="3' in content
        return "schema/fmi3/fmi3ModelDescription.xsd" if version else "schema/fmi2/fmi2ModelDescription.xsd"
    if name == TERMINALS:
        return "schema/fmi3/fmi3TerminalsAndIcons.xsd"
    if name.endswith(MANIFEST):
        return "schema/fmi3/fmi3LayeredStandardManifest.xsd"
    return "ssp/schema/SystemStructureDescription.xsd" if name.endswith(".ssd") else None


def _violations(content: bytes, schema: str, name: str) -> Iterator[str]:
    fmpy()
    from lxml import etree

    try:
        xml(content)
        root: Any = etree.fromstring(content)
    except (ValueError, SyntaxError) as error:  # those of ElementTree and of lxml are syntax errors
        yield f"{name}: {error}"
        return
    if name.endswith(MANIFEST):  # a layered standard may name its root as it likes
        root.tag = LS_ROOT
    for part, rules in [(root, schema), *((values, VALUES) for values in root.iter(VALUES_ROOT))]:
        checker = etree.XMLSchema(file=str(_folder() / rules))
        if not checker.validate(part):
            yield from (f"{name}, line {entry.line}: {entry.message}" for entry in checker.error_log)


def _folder() -> Path:
    spec = importlib.util.find_spec("fmpy")
    assert spec is not None and spec.origin is not None
    return Path(spec.origin).parent
