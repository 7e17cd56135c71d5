"""CSV and text tables: supported layouts, and one sentence for each bad file."""

import numpy as np
import pytest

import identification as idn

GOOD = {
    "comma": "time,angle [deg]\n0,180\n0.5,360\n",
    "semicolon and decimal comma": "time;angle [deg]\n0;180\n0,5;360,0\n",
    "decimal commas late": "time;angle [deg]\n0;180\n0,5;360\n",
    "decimal commas first": "time;angle [deg]\n0,0;180,0\n0,5;360\n",
    "semicolon and point": "time;angle [deg]\n0;180\n0.5;360.0\n",
    "tab": "time\tangle [deg]\n0\t180\n0.5\t3.6e2\n",
    "spaces": "time   angle[deg]\n0   180\n  0.5  360\n",
    "carriage returns": "time,angle [deg]\r\n0,180\r\n0.5,360\r\n",
    "byte order mark": "\ufefftime,angle [deg]\n0,180\n0.5,360\n",
    "units below": "time,angle\ns,deg\n0,180\n0.5,360\n",
    "units below in brackets": "time,angle\n(s),(deg)\n\n0,180\n0.5,360\n",
    "preamble and comments": "Rig 3\n# 2024\nOperator,me,too\n\ntime,angle (deg)\n0,180\n0.5,360\n",
    "quotes": '"time","angle [deg]"\n"0","180"\n"0.5","360"\n',
    "no last newline": "time,angle [deg]\n0,180\n0.5,360",
    "milliseconds": "time [ms],angle [rev]\n0,0.5\n500,1\n",
}


@pytest.mark.parametrize("case", GOOD)
def test_every_usual_layout_is_read(written, case):
    record = idn.read(written("a.csv", GOOD[case]))
    assert record["time"].values == pytest.approx([0, 0.5])
    assert record["angle"].values == pytest.approx([np.pi, 2 * np.pi])


def test_a_table_without_heading_goes_by_numbers(written):
    path = written("a.txt", "0 1\n1 2\n2 3\n")
    channels = {"time": {"column": 1, "unit": "s"}, "channels": {"angle": {"column": 2, "unit": "rad"}}}
    assert idn.read(path, channels)["angle"].values.tolist() == [1, 2, 3]


def test_a_mapping_may_state_the_layout(written):
    mapping = {
        "time": {"sample_rate": "1 Hz"},
        "channels": {"angle": {"column": 1, "unit": "rad"}},
        "file": {"delimiter": "space", "decimal": "comma"},
    }
    assert idn.read(written("a.csv", "1,5 2,5\n2,5 3,5\n"), mapping)["angle"].values.tolist() == [1.5, 2.5]


HEAD = "time,angle\n0,1\n"
BAD = {
    "formula": (HEAD + "1,=cmd|' /C calc'!A0\n", "line 3, column 'angle': \"=cmd|' /C calc'!A0\" is not a number"),
    "formula first": ("time,angle\n0,=1+1\n1,2\n", "line 2, column 'angle': '=1+1' is not a number; correct"),
    "only formulas": ("time,angle\n0,=1+1\n", "line 2, column 'angle': '=1+1' is not a number"),
    "word": (HEAD + "1,two\n", "line 3, column 'angle': 'two' is not a number"),
    "underscore": (HEAD + "1,1_0\n", "'1_0' is not a number"),
    "NUL": (HEAD + "1,2\0\n", "line 3: holds NUL characters"),
    "late NUL": (
        HEAD + "".join(f"{i},0\n" for i in range(1, 600)) + "600,\0\n",
        "line 602, column 'angle': '\\x00' is",
    ),
    "binary": (b"time,angle\n\x00\x01\x02" * 100, "NUL characters; the file is binary or damaged"),
    "a million columns": (",".join(f"c{i}" for i in range(10**6)) + "\n", "line 1: is longer than 1000000 characters"),
    "many columns": (",".join("c" * 2000) + "\n" + ",".join("1" * 2000) + "\n", "2000 columns are above the limit"),
    "decimal comma": ("time,angle\n0,0,1,5\n0,5,2,5\n", "line 1: a heading of 2 cells above rows of 4"),
    "thousands": ("time;angle\n0;1,234.5\n1;2\n", "line 2, column 'angle': '1,234.5' is not a number"),
    "comma and point": ("time;angle\n0,5;1\n1.5;1\n", "line 3, column 'time': '1.5' is not a number"),
    "point and comma": ("time;angle\n0.5;1\n1,5;1\n", "line 3, column 'time': '1,5' is not a number"),
    "ragged": (HEAD + "1,2,3\n2,3\n", "line 3: 3 cells, expected 2; correct or remove the line"),
    "cut off": (HEAD + "1,2\n2", "line 4: 1 cells, expected 2; the file may be cut off"),
    "missing value": (HEAD + "1,\n2,3\n", "record.angle: 1 NaN or infinite values, the first at time 1;"),
    "NaN": (HEAD + "1,NaN\n2,3\n", "record.angle: 1 NaN or infinite values"),
    "infinite": (HEAD + "1,inf\n2,3\n", "record.angle: 1 NaN or infinite values"),
    "gap": (HEAD + "1,2\n2,3\n9,3\n", "record.time: 1 gaps in samples 1 s apart, the first of 7 s after 2 s"),
    "duplicate": (HEAD + "1,2\n1,2\n2,3\n", "time stands still at 1 places, the first after sample 2 at 1 s"),
    "falling": (HEAD + "1,2\n0.5,2\n2,3\n", "time falls at 1 places"),
    "one row": (HEAD, "1 samples; a record needs at least 2"),
    "only a heading": ("time,angle\n", "no row of numbers; is it a table?"),
    "prose": ("Dear all,\nplease find attached\n", "no row of numbers"),
    "unknown unit": ("time,angle [furlong]\n0,1\n1,2\n", "angle: unit 'furlong' is not a known unit of angle"),
    "wrong unit": ("time [m],angle\n0,1\n1,2\n", "time: unit 'm' is not a known unit of time"),
    "no time": ("angle\n0\n1\n", "no time; a mapping needs [time]"),
    "one axis": ("time,disc_x\n0,1\n1,2\n", "disc: only x and no y"),
    "name with escape": ("time,\x1b[31mangle\n0,1\n1,2\n", "is not a valid name for column 2"),
    "long name": ("time," + "a" * 300 + "\n0,1\n1,2\n", "is not a valid name for column 2"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_table_is_answered_with_one_sentence(written, case):
    content, sentence = BAD[case]
    path = written("a.csv", content)
    with pytest.raises((idn.ReadError, idn.SchemaError)) as caught:
        idn.read(path)
    text = str(caught.value)
    assert text.startswith(f"{path}: ") and sentence in text
    assert "\n" not in text and text.isprintable() and len(text) < 500


@pytest.mark.parametrize("cut", [0.3, 0.9, 0.9999])
def test_a_record_of_ours_that_was_cut_off_is_noticed(record, tmp_path, cut):
    path = idn.save(record, tmp_path / "a.csv")
    content = path.read_bytes()
    last = content.rindex(b"\n", 0, int(len(content) * cut))
    path.write_bytes(content[: last + 1])
    with pytest.raises(idn.ReadError, match=r"rows, its header states 200|no row of numbers"):
        idn.read(path)


def test_a_record_of_ours_with_a_damaged_header_is_refused(record, tmp_path):
    path = idn.save(record, tmp_path / "a.csv")
    for damage in (b"[", b'{"attrs": 1, "variables": {}, "samples": 200}', b"{" * 100_000):
        lines = path.read_bytes().split(b"\n")
        lines[1] = b"# " + damage
        (tmp_path / "b.csv").write_bytes(b"\n".join(lines))
        with pytest.raises(idn.ReadError, match="header"):
            idn.read(tmp_path / "b.csv")


PLACES = {
    "none": "not there",
    "folder": "not a file",
    "empty.csv": "empty",
    "broken": "link",
    "a.pkl": "pickle",
    "a.npy": "NumPy",
    "a.xlsx": "spreadsheet",
    "a.csv.gz": "compressed",
    "a.bin": "unknown kind",
    "classic.nc": "classic netCDF",
    "text.nc": ".nc file",
}


@pytest.mark.parametrize("name", PLACES)
def test_what_is_no_file_of_data_is_named(written, tmp_path, name):
    (tmp_path / "folder").mkdir()
    (tmp_path / "broken").symlink_to(tmp_path / "nowhere")
    for file, content in {
        "empty.csv": b"",
        "a.pkl": b"\x80\x04\x95cbuiltins\nprint\n",
        "a.npy": b"\x93NUMPY\x01\x00",
        "a.xlsx": b"PK\x03\x04",
        "a.csv.gz": b"\x1f\x8b\x08",
        "a.bin": b"data",
        "classic.nc": b"CDF\x01\x00\x00\x00\x00",
        "text.nc": b"time,angle\n0,1\n",
    }.items():
        written(file, content)
    with pytest.raises(idn.ReadError) as caught:
        idn.read(tmp_path / name)
    assert str(caught.value).startswith(f"{tmp_path / name}: ") and PLACES[name] in str(caught.value)


def test_a_link_to_a_file_is_read(written, tmp_path):
    (tmp_path / "link.csv").symlink_to(written("a.csv", HEAD + "1,2\n"))
    assert idn.read(tmp_path / "link.csv").sizes["time"] == 2


def test_a_link_to_itself_ends_with_a_sentence(tmp_path):
    (tmp_path / "loop.csv").symlink_to(tmp_path / "loop.csv")
    with pytest.raises(idn.ReadError, match="link"):
        idn.read(tmp_path / "loop.csv")


@pytest.mark.parametrize("encoding", ["utf-8", "latin-1", "cp1252"])
@pytest.mark.parametrize("heading", ["time,angle [°]\n", ""])
def test_a_byte_order_mark_is_no_part_of_the_text_behind_it(tmp_path, encoding, heading):
    (tmp_path / "a.csv").write_bytes(b"\xef\xbb\xbf" + f"{heading}0,180\n0.5,360\n".encode(encoding))
    table = idn.columns(tmp_path / "a.csv")
    assert table.columns[0].name == ("time" if heading else "column 1")
    assert table.columns[0].values.tolist() == [0.0, 0.5] and table.columns[1].values.tolist() == [180.0, 360.0]
