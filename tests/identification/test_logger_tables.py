"""Tables as loggers write them: preambles of key;value, Latin-1, rounded stamps, empty columns, filled-up lines."""

import numpy as np
import pytest

import identification as idn
from identification.records.sampling import problems, unrounded
from rotorsim.base.errors import SchemaError

RATE, COUNT = 12800.0, 12800
T = np.arange(COUNT) / RATE
W = 2 * np.pi * 47.3
X, Y = 30 * np.cos(W * T), 20 * np.sin(W * T)
PREAMBLE = ["Gerät;QuantumX", "Prüfer;Jürgen Groß", "Datum;2026-01-05", "Abtastrate;12800", "Zahl;4", "Stand;Läuft", ""]
CHANNELS = {
    "time": {"column": 1, "unit": "s"},
    "channels": {"disc_measured": {"x": {"column": "Weg X", "unit": "um"}, "y": {"column": "Weg Y", "unit": "um"}}},
}


def write(path, above, time, form="%.5f", delimiter=";", comma=True, empty="", encoding="latin-1", end=""):
    rows = [
        delimiter.join(filter(None, [form % t, empty and "\0", f"{x:.4f}", f"{y:.4f}"])).replace("\0", "") + end
        for t, x, y in zip(time, X, Y, strict=True)
    ]
    text = "\n".join(above + [row.replace(".", ",") if comma else row for row in rows]) + "\n"
    path.write_text(text, encoding=encoding)
    return path


@pytest.mark.parametrize("encoding", ["latin-1", "utf-8", "utf-16", "utf-8-sig"])
def test_header_lines_of_key_and_value_are_passed_over(tmp_path, encoding):
    path = write(tmp_path / "a.csv", [*PREAMBLE, "Zeit;Weg X;Weg Y", "s;µm;µm"], T, encoding=encoding)
    record = idn.read(path, CHANNELS)
    assert idn.examine(record).sample_rate == RATE
    assert record["disc_measured"].sel(axis="x").values == pytest.approx(X * 1e-6, abs=1e-10)
    assert idn.columns(path).rate == RATE and [c.unit for c in idn.columns(path).columns] == ["s", "µm", "µm"]


def test_key_and_value_above_a_table_of_two_columns_are_no_heading(tmp_path):
    lines = [
        *PREAMBLE,
        "Zeit;Weg X",
        "s;µm",
        *(f"{t:.5f};{x:.3f}".replace(".", ",") for t, x in zip(T, X, strict=True)),
    ]
    (tmp_path / "a.csv").write_text("\n".join(lines), encoding="latin-1")
    assert [(c.name, c.unit) for c in idn.columns(tmp_path / "a.csv").columns] == [("Zeit", "s"), ("Weg X", "µm")]


@pytest.mark.parametrize(
    "above",
    [
        [f"setting {k};{k}" for k in range(30)],
        ["7", "2026;1", "Prøve;;", "Dato;2026;", "Kanal;;"],
        ["# comment; with; signs", "name: Jürgen; Groß; x"],
    ],
    ids=["30 lines", "filled up by a spreadsheet", "comments"],
)
def test_whatever_stands_above_the_heading_the_table_is_read(tmp_path, above):
    path = write(tmp_path / "a.csv", [*above, "Zeit;Weg X;Weg Y"], T)
    assert idn.examine(idn.read(path, CHANNELS)).sample_rate == RATE


def test_an_empty_column_does_no_harm(tmp_path):
    rows = [f"{t:.6f};;{x:.4f};{y:.4f}" for t, x, y in zip(T, X, Y, strict=True)]
    (tmp_path / "a.csv").write_text("\n".join(["Zeit;leer;Weg X;Weg Y", "s;;µm;µm", *rows]), encoding="latin-1")
    record = idn.read(tmp_path / "a.csv", CHANNELS)
    assert idn.examine(record).problems == () and "leer" in record.attrs["unused_columns"]


@pytest.mark.parametrize(
    ("head", "end"), [("Zeit;Weg X;Weg Y;", ";"), ("Zeit;Weg X;Weg Y", ";"), ("Zeit;Weg X;Weg Y;", "")]
)
def test_a_delimiter_may_end_the_heading_the_rows_or_both(tmp_path, head, end):
    path = write(tmp_path / "a.csv", [head], T, end=end)
    assert idn.read(path, CHANNELS).sizes["time"] == COUNT


def test_a_labview_measurement_file_is_read(tmp_path):
    above = ["LabVIEW Measurement\t", "Writer_Version\t2", "***End_of_Header***\t", "\t\t\t", "Channels\t2\t\t",
             "Samples\t12800\t12800\t", "X0\t0.0E+0\t0.0E+0\t", "Delta_X\t7.8125E-5\t7.8125E-5\t",
             "***End_of_Header***\t\t\t", "X_Value\tWeg X\tWeg Y\tComment"]  # fmt: skip
    path = write(tmp_path / "a.lvm", above, T, "%.6f", "\t", comma=False)
    assert idn.columns(path).rate == pytest.approx(RATE)
    assert idn.examine(idn.read(path, CHANNELS)).sample_rate == RATE


@pytest.mark.parametrize("form", ["%.4f", "%.5f", "%.6f", "%.6g", "%.5g", "%.7g"])
@pytest.mark.parametrize("rate", [2048.0, 12800.0, 51200.0])
@pytest.mark.parametrize("start", [0.0, 20.0, 700.0])
def test_the_rate_of_rounded_stamps_follows_from_their_whole_length(form, rate, start):
    true = start + np.arange(30_000) / rate
    stamps = np.array([float(form % t) for t in true])
    found = unrounded(stamps)
    coarse = np.abs(stamps - true).max()
    if coarse * 2 > 1e-3 * np.ptp(true):
        assert found is stamps  # so few different stamps show nothing
        return
    assert not problems(found)
    assert (found.size - 1) / np.ptp(found) == pytest.approx(rate, rel=2e-5 if coarse < 1e-4 else 1e-3)
    assert np.abs(found - true).max() < 4 * coarse + 1e-9


@pytest.mark.parametrize("cut", [np.floor, np.ceil, np.round])
def test_stamps_may_be_cut_off_as_well_as_rounded(cut):
    stamps = cut(T * 1e5) / 1e5
    assert np.ptp(unrounded(stamps)) == pytest.approx(np.ptp(T), rel=1e-4) and not problems(unrounded(stamps))


@pytest.mark.parametrize("fault", ["lost", "jitter", "back", "drift"])
def test_what_rounding_does_not_explain_stays(fault):
    rng = np.random.default_rng(0)
    t = {
        "lost": np.delete(T, slice(6000, 6004)),
        "jitter": T + 2e-5 * rng.standard_normal(T.size),
        "back": np.concatenate([T[:6000], T[5000:]]),
        "drift": T * (1 + 1e-3 * T),
    }[fault]
    stamps = np.round(t, 5)
    assert unrounded(stamps) is stamps and problems(stamps)


def test_the_record_notes_that_its_clock_is_not_the_files(tmp_path):
    path = write(tmp_path / "a.csv", ["Zeit;Weg X;Weg Y"], T)
    assert any("rounded" in text and "12800 Hz" in text for text in idn.notes_of(idn.read(path, CHANNELS)))
    path = write(tmp_path / "b.csv", ["Zeit;Weg X;Weg Y"], T, "%.9f")
    assert not any("rounded" in text for text in idn.notes_of(idn.read(path, CHANNELS)))


def test_gaps_of_rounded_stamps_are_still_cut_out(tmp_path):
    gone = np.where(np.arange(COUNT) >= 6000, T + 0.5, T)
    path = write(tmp_path / "a.csv", ["Zeit;Weg X;Weg Y"], gone)
    with pytest.raises(SchemaError, match="gap"):
        idn.read(path, CHANNELS)
    parts = idn.whole_stretches(idn.load(path, CHANNELS), 0.1)
    assert [part.sizes["time"] for part in parts] == [6000, 6800]
    assert [idn.examine(part).sample_rate for part in parts] == [RATE, RATE]


@pytest.mark.parametrize(
    ("line", "rate"),
    [("Abtastrate;12800", 12800), ("Sample rate: 12.8 kHz", 12800), ("Sampling frequency [kHz],12.8", 12800),
     ("# fs = 25600 Hz", 25600), ("Samplingsfrekvens;5000;Hz", 5000), ("Fréquence d'échantillonnage;2048", 2048),
     ("Sample Interval,2.0E-4,s", 5000), ("Delta_X\t7.8125E-5", 12800), ("Messrate;1,2 kHz", 1200)],
)  # fmt: skip
def test_a_rate_above_the_table_is_kept(tmp_path, line, rate):
    (tmp_path / "a.csv").write_text(f"{line}\na;b;c\n" + "1;2;3\n2;3;4\n" * 5, encoding="latin-1")
    assert idn.columns(tmp_path / "a.csv").rate == pytest.approx(rate)


POINT, COMMA, WHOLE = "0.5;2.25\n", "0,5;2,25\n", "1;2\n"
CLOCKED = "Time [ms];x\n" + "".join(f"{k / 12.8:.6f};{k % 7}\n" for k in range(2000))


@pytest.mark.parametrize(
    ("line", "table", "rate"),
    [
        ("Sample Rate: 12,800 Hz", POINT, 12800), ("Sample rate (Hz): 12,800", POINT, 12800),
        ("Abtastrate;12.800 Hz", COMMA, 12800), ("Abtastrate;12,800 Hz", COMMA, 12.8),
        ("Sample rate: 500.000 Hz", POINT, 500), ("fs = 1.000 Hz", COMMA, 1000), ("fs = 1.000 Hz", POINT, 1),
        ("Sample Rate: 51,200.00 Hz", WHOLE, 51200), ("Abtastrate;51.200,00", WHOLE, 51200),
        ("Abtastrate;1.024.000", WHOLE, 1024000), ("Sample interval: 0.078 ms", WHOLE, 1 / 7.8e-5),
        ("Abtastrate;51 200 Hz", WHOLE, 51200), ("Abtastrate;51'200,0 Hz", WHOLE, 51200),
        ("Sample rate: 51.200 kHz", WHOLE, 51200), ("Sample rate: 12800.000", WHOLE, 12800),
        ("Sample Rate: 12,800 Hz", CLOCKED, 12800), ("Sample Rate: 12.800 Hz", CLOCKED, 12800),
        ("Abtastrate;12,800 Hz", CLOCKED, 12800),
    ],
)  # fmt: skip
def test_separators_of_thousands_in_a_stated_rate(tmp_path, line, table, rate):
    text = table if table is CLOCKED else "a;b\n" + table * 10
    (tmp_path / "a.csv").write_text(f"{line}\n{text}", encoding="utf-8")
    assert idn.columns(tmp_path / "a.csv").rate == pytest.approx(rate)


@pytest.mark.parametrize("line", ["Sample rate,500,500", 'Sample rate,"500",500', "Sample rate,500.0,500"])
def test_a_comma_between_cells_is_no_part_of_a_rate(tmp_path, line):
    (tmp_path / "a.csv").write_text(f"{line}\na,b,c\n" + "0.5,2,3\n" * 10)
    assert idn.columns(tmp_path / "a.csv").rate == 500.0


@pytest.mark.parametrize(
    ("line", "table"),
    [("Sample Rate: 12,800 Hz", WHOLE), ("Abtastrate;12.800 Hz", WHOLE), ("fs = 12.800", WHOLE),
     ("Sample Rate: 12,800 Hz", COMMA), ("Abtastrate;12.800 Hz", POINT)],
)  # fmt: skip
def test_a_rate_that_may_be_two_is_left_out_with_a_sentence(tmp_path, line, table):
    """Nothing else in the file shows its decimal sign, or the language of the statement has another one."""
    (tmp_path / "a.csv").write_text(f"{line}\na;b\n" + table * 10)
    found = idn.columns(tmp_path / "a.csv")
    assert found.rate is None and "12.8 Hz or 12800 Hz" in found.notes[0]
    assert f"# {found.notes[0]}" in idn.propose(found, "a.csv")[0]


@pytest.mark.parametrize("line", ["sample rate of version 1.2.3", "fs: ,5", "Messrate;;", "dt and fs = ."])
def test_what_is_no_rate_is_passed_over(tmp_path, line):
    (tmp_path / "a.csv").write_text(f"{line}\na;b;c\n" + "1;2;3\n2;3;4\n" * 5, encoding="latin-1")
    assert idn.columns(tmp_path / "a.csv").rate in (None, 5.0)


def test_a_record_of_ours_with_rates_in_its_header_is_read_back(tmp_path):
    record = idn.make_record(T[:100], {"disc_measured": np.column_stack([X, Y])[:100]})
    idn.save(record.assign_attrs(sample_rate_hz=12800.5, fs="1.2.3", sampling_interval="0.1.2"), tmp_path / "a.csv")
    assert idn.read(tmp_path / "a.csv").attrs["fs"] == "1.2.3"
