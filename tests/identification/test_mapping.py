"""Mappings of columns to channels and units, and invalid mappings."""

import tomllib

import numpy as np
import pytest

import identification as idn
from identification.records.mapping import load_mapping
from identification.records.sampling import nominal_rate

CSV = "t,X probe,Y probe [mV],rpm\n0,1,1000,600\n0.2,2,2000,600\n0.4,3,3000,600\n"
GOOD = """
[time]
column = "t"
unit = "ms"
[channels.disc_measured.x]
column = "X probe"
unit = "V"
sensitivity = "8 V/mm"
sign = -1
offset = "0.1 mm"
[channels.disc_measured.y]
column = 3
sensitivity = "8 V/mm"
scale = 2
[channels.speed]
column = "rpm"
unit = "rpm"
[constants]
pressure = "0.3 MPa"
"""


def test_a_mapping_gives_channels_in_si_units(written):
    record = idn.read(written("a.csv", CSV), written("m.toml", GOOD))
    assert record["time"].values == pytest.approx([0, 2e-4, 4e-4])
    assert record["disc_measured"].sel(axis="x").values == pytest.approx(np.array([-25, -150, -275]) * 1e-6)
    assert record["disc_measured"].sel(axis="y").values == pytest.approx(np.array([250, 500, 750]) * 1e-6)
    assert record["speed"].values == pytest.approx(np.full(3, 20 * np.pi))
    assert record["pressure"].values.tolist() == [3e5] * 3
    assert record.attrs["mapping"] == GOOD and record.attrs["source"] == "a.csv"


def test_a_sample_rate_stands_for_a_time_column(written):
    mapping = {"time": {"sample_rate": "5 kHz"}, "channels": {"angle": {"column": "t", "unit": "rad"}}}
    record = idn.read(written("a.csv", CSV), mapping)
    assert record["time"].values == pytest.approx([0, 2e-4, 4e-4])


def changed(old, new):
    return GOOD.replace(old, new, 1)


BAD = {
    "no toml": ("[time", "not a TOML file: "),
    "disc without position": (GOOD + "[disc]\n", "disc.position: is missing"),
    "unknown section": (GOOD + "[channel]\n", "mapping: unknown entry 'channel'; did you mean 'channels'?"),
    "unknown channel": (changed("channels.speed", "channels.sped"), "channels.sped: no such channel; did you mean"),
    "unknown entry": (changed('unit = "rpm"', 'units = "rpm"'), "channels.speed: unknown entry 'units'; did you mean"),
    "no column": (changed('column = "rpm"', ""), "channels.speed.column: None; give the column's name"),
    "missing column": (
        changed('column = "rpm"', 'column = "RPM"'),
        "channels.speed: no column 'RPM'; the file has 't'",
    ),
    "column number": (changed("column = 3", "column = 9"), "no column 9; the file has columns 1 to 4"),
    "unknown unit": (changed('unit = "rpm"', 'unit = "krpms"'), "'krpms' is not a known unit of rotational speed"),
    "no unit": (changed('unit = "rpm"', ""), "channels.speed: no unit, neither here nor in the file"),
    "needless sensitivity": (changed('unit = "V"', 'unit = "mm"'), "is in 'mm' already, a length; write 'scale'"),
    "scale": (changed("scale = 2", "scale = 0"), "disc_measured.y.scale: 0; give a number other than 0"),
    "sign": (changed("sign = -1", "sign = 2"), "disc_measured.x.sign: 2; write 1 or -1"),
    "offset": (changed('offset = "0.1 mm"', "offset = 0.1"), "offset: 0.1 has no unit"),
    "only x": (GOOD.split("[channels.disc_measured.y]")[0], "disc_measured: only x and no y"),
    "third axis": (GOOD + '[channels.disc_measured.z]\ncolumn = 1\nunit = "m"', "unknown axis 'z'; write x or y"),
    "no axis": (GOOD + '[channels.journal]\ncolumn = 1\nunit = "m"', "channels.journal.column: 1 is not a table"),
    "constant": (changed('"0.3 MPa"', "0.3"), "constants.pressure: 0.3 is not a gauge pressure with its unit"),
    "constant twice": (GOOD + 'speed = "600 rpm"', "speed is a channel and a constant; remove one"),
    "constant vector": (GOOD + 'pin = "6 um"', "constants.pin: no quantity that a constant can give"),
    "wrong rate": (changed("[time]", '[time]\nsample_rate = "2 kHz"'), "2000 Hz, but the file's time gives 5000 Hz"),
    "rate": (
        changed("[time]", "[time]\nsample_rate = 2000"),
        "time.sample_rate: 2000 is not a sample rate with its unit",
    ),
    "no time": (
        changed('[time]\ncolumn = "t"\nunit = "ms"', ""),
        "no time; a mapping needs [time] with a column or a sample_rate",
    ),
    "nothing": ("", "map at least one column"),
    "a constant alone": ('[constants]\npressure = "1 bar"\n[conditions]\nclock = "1 ms"', "map at least one column"),
    "vectors too": (GOOD + "[vectors.1X.x]\namplitude = {column=1}\nphase = {column=1}", "a file is one or the other"),
    "order": ("[vectors.first.x]", "vectors.first: not an order; write e.g. [vectors.1X.x]"),
    "no table": ("time = 3", "time: 3 is not a table; write [time]"),
    "delimiter": (GOOD + '[file]\ndelimiter = "|"', "file.delimiter: '|'; write one of comma, semicolon, tab, space"),
    "encoding": (GOOD + '[file]\nencoding = "klingon"', "file.encoding: 'klingon' is no encoding"),
    "bytes": (b"\xff\xfe\x00", "cannot be read as text; a mapping is TOML in UTF-8"),
    "nested": ("a = " + "[" * 100_000, ""),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_mapping_is_answered_with_one_sentence(written, case):
    text, sentence = BAD[case]
    with pytest.raises(idn.ReadError) as caught:
        idn.read(written("a.csv", CSV), written("m.toml", text))
    assert sentence in str(caught.value) and "\n" not in str(caught.value) and len(str(caught.value)) < 600


def test_a_mapping_that_is_not_there_is_named(written, tmp_path):
    with pytest.raises(idn.ReadError, match=r"none\.toml"):
        idn.read(written("a.csv", CSV), tmp_path / "none.toml")


VECTORS = "rpm,A1,P1,A1y,P1y\n600,20,-30,10,-60\n1200,30,-40,20,-70\n"
VECTOR_MAP = """
[speed]
column = "rpm"
unit = "rpm"
[vectors.1X.x]
amplitude = { column = "A1", unit = "um pp" }
phase = { column = "P1", unit = "deg", sign = -1 }
[vectors.1X.y]
amplitude = { column = "A1y", unit = "um pp" }
phase = { column = "P1y", unit = "deg", sign = -1 }
"""


def test_vectors_in_peak_to_peak_and_lead_become_0_pk_and_lag(written):
    vectors = idn.read(written("v.csv", VECTORS), written("m.toml", VECTOR_MAP))
    assert vectors["speed"].values == pytest.approx(np.array([20, 40]) * np.pi)
    assert vectors["amplitude"].sel(order=1, axis="x").values == pytest.approx([10e-6, 15e-6])
    assert np.degrees(vectors["phase"].sel(order=1, axis="y").values) == pytest.approx([60, 70])


def test_vectors_with_names_of_the_schema_need_no_mapping(written):
    head = "speed [rpm],amplitude_2X_x [um pp],phase_2X_x [deg],amplitude_2X_y [um],phase_2X_y [deg]\n"
    vectors = idn.read(written("v.csv", head + "600,20,30,10,60\n300,30,40,20,70\n"))
    assert vectors["order"].values.tolist() == [2]
    assert vectors["amplitude"].sel(order=2).values == pytest.approx(np.array([[10, 10], [15, 20]]) * 1e-6)


def test_vectors_of_one_axis_are_of_one_probe_and_orders_of_different_axes_are_refused(written):
    cut = VECTOR_MAP.split("[vectors.1X.y]")[0]
    assert idn.read(written("v.csv", VECTORS), written("m.toml", cut))["axis"].values.tolist() == ["x"]
    other = cut + VECTOR_MAP[VECTOR_MAP.index("[vectors.1X.y]") :].replace("1X", "2X")
    with pytest.raises(idn.ReadError, match="amplitude of 1X: no axis y"):
        idn.read(written("v.csv", VECTORS), written("m2.toml", other))


def test_the_draft_of_a_mapping_reads_what_is_recognised(written):
    path = written("a.csv", 'time [ms],disc_measured_x [um],disc_measured_y [um],"odd \\ name [x]"\n0,1,2,3\n1,2,3,4\n')
    draft = idn.mapping_template(idn.columns(path), path.name)
    assert '# column = "odd \\\\ name"' in draft
    by_draft = idn.read(path, tomllib.loads(draft))
    assert by_draft.equals(idn.read(path))


def test_the_draft_of_foreign_columns_works_once_filled_in(written):
    path = written("a.csv", "t,A,B\n0,1,2\n0.1,2,3\n")
    draft = idn.mapping_template(idn.columns(path), path.name)
    for name, unit in (("time", "s"), ("channels.angle", "rad")):
        old = "# [channels.NAME.x]\n# column = ", '# unit = "?"'
        draft = draft.replace(old[0], f"[{name}]\ncolumn = ", 1).replace(old[1], f'unit = "{unit}"', 1)
    assert idn.read(path, tomllib.loads(draft))["angle"].values.tolist() == [1, 2]


def test_a_name_that_two_columns_bear_is_refused(written):
    path = written("a.csv", "time,angle,angle\n0,1,2\n1,2,3\n")
    assert "# column = 3\n" in idn.mapping_template(idn.columns(path), path.name)
    with pytest.raises(idn.ReadError, match="'angle'"):
        idn.read(path)
    with pytest.raises(idn.ReadError, match=r"'angle' .* 2 "):
        idn.read(path, {"time": {"column": 1, "unit": "s"}, "channels": {"angle": {"column": "angle", "unit": "rad"}}})


def test_columns_without_meaning_are_never_guessed(written):
    with pytest.raises(idn.ReadError, match="column"):
        idn.read(written("a.csv", "t,x,y\n0,1,2\n1,2,3\n"))


def test_conditions_of_a_mapping_become_attributes_in_si(written):
    stated = '[conditions]\naccuracy = "0.5 um"\nrate = "60 rpm/s"\npressure = "0.5 MPa"\n'
    vectors = idn.read(written("v.csv", VECTORS), written("m.toml", stated + VECTOR_MAP))
    found = {name: vectors.attrs[name] for name in ("accuracy", "rate", "pressure")}
    assert found == pytest.approx({"accuracy": 5e-7, "rate": 2 * np.pi, "pressure": 5e5})


@pytest.mark.parametrize("one", ['rate = "60 rpm"', 'accuracy = "-1 um"', 'accuracy = "1 V"', "humidity = 1"])
def test_conditions_without_sense_are_refused_by_name(written, one):
    with pytest.raises(idn.ReadError, match="conditions"):
        idn.read(written("v.csv", VECTORS), written("m.toml", f"[conditions]\n{one}\n" + VECTOR_MAP))


def test_a_mapping_of_conditions_alone_leaves_the_columns_to_their_names(tmp_path):
    """A table of vectors, and the record of it as netCDF: 229 rpm/s is 23.98 rad/s2."""
    table = tmp_path / "v.csv"
    head = "speed [rpm],amplitude_1X_x [um],phase_1X_x [deg],amplitude_1X_y [um],phase_1X_y [deg]\n"
    table.write_text(head + "".join(f"{1000 + 50 * k},{10 + k},30,{10 + k},120\n" for k in range(20)))
    (tmp_path / "m.toml").write_text('[conditions]\nrate = "229 rpm/s"\nclock = "2 ms"\n')
    plain, read = idn.read(table), idn.read(table, tmp_path / "m.toml")
    assert read.attrs["rate"] == pytest.approx(229 * np.pi / 30) and read.attrs["clock"] == 2e-3
    assert read.drop_attrs().identical(plain.drop_attrs())
    idn.save(plain, tmp_path / "v.nc")
    assert idn.read(tmp_path / "v.nc", tmp_path / "m.toml").attrs["clock"] == 2e-3


@pytest.mark.parametrize(("rate", "decimals"), [(25600.0, 6), (5120.0, 5), (5000.0, 9), (51200.0, 7), (12345.678, 9)])
def test_the_rate_of_rounded_time_stamps_is_the_round_number(rate, decimals):
    time = np.round(np.arange(int(4 * rate)) / rate, decimals)
    assert nominal_rate(time) == pytest.approx(rate, rel=1e-7 if decimals > 6 else 1e-12)


def test_an_unknown_entry_of_a_keyphasor_is_told_its_own_entries():
    table = {"keyphasor": {"column": 1, "unit": "V", "edges": "falling"}}
    with pytest.raises(idn.ReadError, match="'edge'"):
        load_mapping(table)
