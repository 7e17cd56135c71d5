"""Thirty imports of foreign objects and files: nothing in them is dropped, shifted or taken for another unit silently.

Each case holds something that a reader could lose. It is carried (a number shows it), refused by name, or named in a
sentence on the record or in a warning.
"""

import json
import warnings
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.io import savemat

import identification as idn
import rotorsim as rs
from identification.records.schema import notes_of
from rotorsim.errors import DataError, LawError, ModelError, NotCarried, ShaftError

N, TS = 400, 1e-3
T = np.arange(N) * TS
SIGNAL = np.sin(40 * T) * 1e-6
PAIR = {"x": {"column": "X"}, "y": {"column": "Y"}}
LATE = 25
"""Samples by which one channel starts later than the other."""


def mapped(unit=None, **more):
    """A mapping of the columns X and Y."""
    channels = {axis: entry | ({"unit": unit} if unit else {}) for axis, entry in PAIR.items()}
    return {"channels": {"disc_measured": channels}} | more


def tdms(path, *channels, root=None):
    nptdms = pytest.importorskip("nptdms")
    with nptdms.TdmsWriter(path) as writer:
        objects = [nptdms.RootObject(root)] if root else []
        writer.write_segment([*objects, *(nptdms.ChannelObject("rig", *channel) for channel in channels)])
    return path


def wave(start=0.0, **more):
    at = np.datetime64("2024-01-01T00:00:00", "us") + np.timedelta64(round(start * 1e6), "us")
    return {"wf_increment": TS, "wf_start_offset": 0.0, "wf_start_time": at, "unit_string": "um"} | more


def uff(*responses):
    """Datasets 58 (title, values, start [s], unit, further lines)."""
    return "".join(_dataset(*response) for response in responses).encode()


def _dataset(title, values, start=0.0, unit="um", more="", time="s"):
    numbers = [f"{value:20.11E}" for value in values]
    lines = "\n".join("".join(numbers[i : i + 4]) for i in range(0, len(numbers), 4))
    none = f"{0:10d}{0:5d}{0:5d}{0:5d} {'NONE':20s} {'NONE':20s}"
    records = [
        f"{title:80s}", "NONE", "01-JAN-24 00:00:00", "NONE", "NONE",
        f"{1:5d}{1:10d}{0:5d}{0:10d} {'NONE':10s}{1:10d}{1:4d} {'NONE':10s}{0:10d}{0:4d}",
        f"{4:10d}{len(values):10d}{1:10d}{start:13.5E}{TS:13.5E}{0.0:13.5E}",
        f"{17:10d}{0:5d}{0:5d}{0:5d} {'Time':20s} {time:20s}", f"{8:10d}{0:5d}{0:5d}{0:5d} {'Value':20s} {unit:20s}",
        none, none, lines,
    ]  # fmt: skip
    return "    -1\n    58\n" + "\n".join(records) + f"{more}\n    -1\n"


def csv(path, heads, *columns, encoding="utf-8", separator=","):
    rows = (separator.join(f"{value:.12g}" for value in row) for row in zip(*columns, strict=True))
    path.write_bytes("\n".join([separator.join(heads), *rows, ""]).encode(encoding))
    return path


def both(record, scale=1e-6, shift=0):
    """X and Y of a record are the signal, Y from its sample `shift` on."""
    measured = record["disc_measured"].values
    stop = N - shift
    assert measured[:, 0] == pytest.approx(SIGNAL[shift:] / 1e-6 * scale, abs=1e-4 * scale)
    assert measured[:, 1] == pytest.approx(SIGNAL[:stop] / 1e-6 * scale, abs=1e-4 * scale)


def noted(record, *words):
    """The notes name each word."""
    notes = " ".join(notes_of(record))
    assert all(word in notes for word in words), notes


MICRO = SIGNAL * 1e6


def tdms_late(path):
    """The second channel starts 25 samples later: both are cut to what they share, with the samples in line."""
    record = idn.read(tdms(path / "a.tdms", ("X", MICRO, wave()), ("Y", MICRO, wave(LATE * TS))), mapped())
    both(record, shift=LATE)
    noted(record, "start apart", f"{LATE * TS:g} s")


def tdms_offset(path):
    record = idn.read(
        tdms(path / "a.tdms", ("X", MICRO, wave()), ("Y", MICRO, wave(wf_start_offset=LATE * TS))), mapped()
    )
    both(record, shift=LATE)


def tdms_start_of_one_unknown(path):
    stated = wave()
    del stated["wf_start_time"]
    record = idn.read(tdms(path / "a.tdms", ("X", MICRO, wave(5.0)), ("Y", MICRO, stated)), mapped())
    both(record)
    noted(record, "no start is stated", "disc_measured.y")


def tdms_ends(path):
    """A channel that ends a few samples earlier cuts the record, with a note; one of a few samples is refused."""
    file = tdms(path / "a.tdms", ("X", MICRO, wave()), ("Y", MICRO[:-9], wave()))
    record = idn.read(file, mapped())
    assert record.sizes["time"] == N - 9
    noted(record, "end apart")
    with pytest.raises(idn.ReadError, match="9 samples"):
        idn.read(tdms(path / "b.tdms", ("X", MICRO, wave()), ("Y", MICRO[:9], wave())), mapped())


def tdms_part_of_a_sample(path):
    file = tdms(path / "a.tdms", ("X", MICRO, wave()), ("Y", MICRO, wave(25.4 * TS)))
    with pytest.raises(idn.ReadError, match=r"disc_measured\.y begins .* after .*disc_measured\.x"):
        idn.read(file, mapped())


def tdms_no_common_time(path):
    with pytest.raises(idn.ReadError, match="after the end"):
        idn.read(tdms(path / "a.tdms", ("X", MICRO, wave()), ("Y", MICRO, wave(3.0))), mapped())


def tdms_unmapped(path):
    """A slow channel, a setting of one sample, a spectrum and texts that nobody maps do not matter."""
    record = idn.read(
        tdms(
            path / "a.tdms", ("X", MICRO, wave()), ("Y", MICRO, wave()), ("T", np.ones(3), wave(wf_increment=1.0)),
            ("set", np.ones(1), wave(7.0)), ("F", MICRO, wave(wf_xunit_string="Hz")), ("words", ["a", "b"]),
            ("late", MICRO, wave(5.0)),
        ), mapped(),
    )  # fmt: skip
    both(record)
    noted(record, "rig/F", "rig/words")


def tdms_setting(path):
    """A mapped setting of one sample holds throughout."""
    mapping = mapped()
    mapping["channels"]["pressure"] = {"column": "p", "unit": "bar"}
    record = idn.read(
        tdms(path / "a.tdms", ("X", MICRO, wave()), ("Y", MICRO, wave()), ("p", np.ones(1), wave())), mapping
    )
    assert record["pressure"].values.tolist() == [1e5] * N


def tdms_properties(path):
    file = tdms(path / "a.tdms", ("X", MICRO, wave(gain=2.0)), ("Y", MICRO, wave()), root={"operator": "A. B."})
    noted(idn.read(file, mapped()), "gain", "operator")


def tdms_unit(path):
    """`Volts` is read; the file's word for the other is replaced by the mapping's, with a sentence."""
    scaled = mapped()
    scaled["channels"]["disc_measured"]["x"]["sensitivity"] = "8 V/mm"
    scaled["channels"]["disc_measured"]["y"]["unit"] = "um"
    file = tdms(path / "a.tdms", ("X", MICRO, wave(unit_string="Volts")), ("Y", MICRO, wave(unit_string="Mikro")))
    record = idn.read(file, scaled)
    assert record["disc_measured"].values[:, 0] == pytest.approx(MICRO / 8000, abs=1e-12)
    assert record["disc_measured"].values[:, 1] == pytest.approx(SIGNAL, abs=1e-12)
    noted(record, "Mikro", "'um'")


def uff_late(path):
    (path / "a.uff").write_bytes(uff(("X", MICRO), ("Y", MICRO, LATE * TS)))
    record = idn.read(path / "a.uff", mapped())
    both(record, shift=LATE)
    noted(record, "start apart")


def uff_padded(path):
    """Zeros fill the last block; a damaged dataset that nobody maps is named."""
    padding = "".join(f"{0.0:20.11E}" for _ in range(4))
    content = uff(("X", MICRO, 0.0, "um", "\n" + padding), ("Y", MICRO, 0.0, "um", "\n" + padding))
    broken = uff(("broken", MICRO)).replace(b"       400", b"       900")
    (path / "a.uff").write_bytes(content + broken)
    record = idn.read(path / "a.uff", mapped())
    both(record)
    noted(record, "broken")


def uff_unmapped(path):
    (path / "a.uff").write_bytes(uff(("X", MICRO), ("Y", MICRO), ("slow", MICRO[:7], 3.0, "K")))
    both(idn.read(path / "a.uff", mapped()))


def uff_unit_of_time(path):
    """The abscissa in ms is one of ms; over metres it is no time."""
    (path / "a.uff").write_bytes(uff(*((name, MICRO, 0.0, "um", "", "ms") for name in "XY")))
    assert idn.read(path / "a.uff", mapped())["time"].values == pytest.approx(T * 1e-3)
    (path / "a.uff").write_bytes(uff(*((name, MICRO, 0.0, "um", "", "m") for name in "XY")))
    with pytest.raises(idn.ReadError, match="abscissa in 'm'"):
        idn.read(path / "a.uff", mapped())


def uff_unit_system(path):
    """A file that declares another system than SI is read where the mapping states the unit, and not before."""
    declared = b"    -1\n   164\n         5mm (milli-newton)\n    -1\n"
    (path / "a.uff").write_bytes(declared + uff(("X", MICRO), ("Y", MICRO)))
    with pytest.raises(idn.ReadError, match="unit system 5"):
        idn.read(path / "a.uff", mapped())
    record = idn.read(path / "a.uff", mapped("um"))
    both(record)
    noted(record, "unit system 5")


def uff_byte_order_mark(path):
    (path / "a.uff").write_bytes(b"\xef\xbb\xbf" + uff(("X", MICRO), ("Y", MICRO)))
    both(idn.read(path / "a.uff", mapped()))


def csv_pairs_of_time(path):
    """Each channel with its own times, as oscilloscopes write them: those that start later are refused by name."""
    file = csv(path / "a.csv", ["time 1 [s]", "X", "time 2 [s]", "Y"], T, MICRO, T + 3, MICRO)
    with pytest.raises(idn.ReadError, match=r"disc_measured\.y: .*'time 2'"):
        idn.read(file, mapped("um", time={"column": "time 1"}))
    same = csv(path / "b.csv", ["time 1 [s]", "X", "time 2 [s]", "Y"], T, MICRO, T, MICRO)
    both(idn.read(same, mapped("um", time={"column": "time 1"})))


def csv_latin(path):
    file = csv(path / "a.csv", ["time [s]", "X [µm]", "Y [µm]"], T, MICRO, MICRO, encoding="latin-1")
    record = idn.read(file, mapped(time={"column": "time"}))
    both(record)
    noted(record, "latin-1")


def csv_stated_encoding(path):
    file = csv(path / "a.csv", ["time [s]", "Xß", "Y"], T, MICRO, MICRO, encoding="cp850")
    mapping = mapped("um", time={"column": "time"}, file={"encoding": "cp850"})
    mapping["channels"]["disc_measured"]["x"]["column"] = "Xß"
    both(idn.read(file, mapping))


def csv_wide_and_marked(path):
    """UTF-16, as spreadsheets export text, and UTF-8 with a byte order mark."""
    for encoding in ("utf-16", "utf-8-sig"):
        file = csv(path / "a.txt", ["time [s]", "X [um]", "Y [um]"], T, MICRO, MICRO, encoding=encoding, separator="\t")
        both(idn.read(file, mapped(time={"column": "time"})))


def csv_texts(path):
    """A column of dates and one with a word among its numbers, which nobody maps, do no harm; mapped they are named."""
    rows = [f"2024-01-01 12:00:{t:06.3f},{t:.12g},{x:.12g},{x:.12g},1" for t, x in zip(T, MICRO, strict=True)]
    rows[7] = rows[7].removesuffix("1") + "OVERLOAD"
    (path / "a.csv").write_text("\n".join(["date,time [s],X [um],Y [um],state", *rows, ""]))
    mapping = mapped(time={"column": "time"})
    record = idn.read(path / "a.csv", mapping)
    both(record)
    noted(record, "'date'", "OVERLOAD")
    mapping["channels"]["angle"] = {"column": "state", "unit": "rad"}
    with pytest.raises(idn.ReadError, match=r"channels\.angle: line 9, column 'state': 'OVERLOAD'"):
        idn.read(path / "a.csv", mapping)


def csv_unit_row(path):
    path = path / "a.csv"
    csv(path, ["t", "X", "Y", "a"], T, MICRO, MICRO, MICRO)
    path.write_text(path.read_text().replace("t,X,Y,a\n", "t,X,Y,a\nseconds,Microns,µm,m/s²\n", 1))
    mapping = mapped(time={"column": "t"})
    mapping["channels"]["probe_measured"] = {"A": {"column": "a"}}
    record = idn.read(path, mapping)
    both(record)
    assert record["probe_measured"].values[:, 0] == pytest.approx(MICRO, abs=1e-9)
    assert record["probe_unit"].values.tolist() == ["m/s^2"]


def mat_own_times(path):
    savemat(path / "a.mat", {"t": T, "X": MICRO, "Y": MICRO, "Y_time": T + 3})
    with pytest.raises(idn.ReadError, match=r"disc_measured\.y: .*'Y_time'"):
        idn.read(path / "a.mat", mapped("um", time={"column": "t", "unit": "s"}))


def mat_left_out(path):
    savemat(path / "a.mat", {"t": T, "X": MICRO, "Y": MICRO, "setup": {"gain": 2.0}, "slow": MICRO[:3]})
    record = idn.read(path / "a.mat", mapped("um", time={"column": "t", "unit": "s"}))
    both(record)
    noted(record, "setup")
    assert record.attrs["unused_columns"] == ["slow"]


def hdf5(path, **datasets):
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        file.attrs["operator"] = "A. B."
        for name, (values, attributes) in datasets.items():
            file[name] = values
            file[name].attrs.update(attributes)
    return path


def hdf5_late(path):
    clock = {"units": "um", "dt": TS}
    record = idn.read(hdf5(path / "a.h5", X=(MICRO, clock), Y=(MICRO, clock | {"t0": LATE * TS})), mapped())
    both(record, shift=LATE)
    noted(record, "operator", "start apart")


def hdf5_scales(path):
    packed = np.round(MICRO * 1e3).astype(int)
    stated = {"units": "um", "sample_rate": 1 / TS, "scale_factor": 1e-3, "gain": 3.0}
    record = idn.read(hdf5(path / "a.h5", X=(packed, stated), Y=(MICRO, {"units": "um"})), mapped())
    assert record["disc_measured"].values[:, 0] == pytest.approx(SIGNAL, abs=1e-9)
    noted(record, "gain")


def hdf5_groups_of_times(path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(path / "a.h5", "w") as file:
        for group, start in (("A", 0.0), ("B", 3.0)):
            file[f"{group}/time"], file[f"{group}/v"] = T + start, MICRO
    mapping = mapped("um", time={"column": "A/time", "unit": "s"})
    for axis, group in (("x", "A"), ("y", "B")):
        mapping["channels"]["disc_measured"][axis]["column"] = f"{group}/v"
    with pytest.raises(idn.ReadError, match="'B/time'"):
        idn.read(path / "a.h5", mapping)


def arrays_with_units(path):
    """Arrays of xarray that state their unit and their times."""
    import xarray as xr

    wide = np.column_stack([MICRO, MICRO])
    one = xr.DataArray(wide, dims=("time", "axis"), coords={"time": T}, attrs={"units": "um"})
    both(idn.from_arrays(T, None, one))
    with pytest.raises(idn.SchemaError, match="disc_measured"):
        idn.from_arrays(T, None, one.assign_coords(time=T + 3))
    with pytest.raises(idn.SchemaError, match="'furlong'"):
        idn.from_arrays(T, None, one.assign_attrs(units="furlong"))


def frame_of_pandas(path):
    import pandas as pd

    late = pd.Series(np.zeros(N), index=T + 3)
    with pytest.raises(idn.SchemaError, match="speed"):
        idn.from_arrays(T, None, np.column_stack([SIGNAL, SIGNAL]), speed=late)
    both(idn.from_arrays(T, None, np.column_stack([SIGNAL, SIGNAL]), speed=pd.Series(np.zeros(N), index=T)))


MATRICES = {"A": -np.eye(2), "B": np.eye(2), "C": np.eye(2), "D": np.zeros((2, 2)), "Ts": 1e-4}


def cells(*texts):
    found = np.empty((1, len(texts)), object)
    found[0] = texts
    return found


def model_of_matlab(path):
    """Units of the signals are read; delays, E and another unit of time are refused; the rest is named."""
    savemat(path / "m.mat", MATRICES | {"OutputUnit": cells("um", "um"), "InputUnit": cells("mV", "V")})
    model = rs.load_model(path / "m.mat")
    assert pytest.approx(np.diag([1e-6, 1e-6])) == model.C
    assert pytest.approx(np.diag([1e3, 1.0])) == model.B
    for name, value in (("InputDelay", [1e-3, 0]), ("E", 2 * np.eye(2)), ("TimeUnit", "minutes"), ("OutputUnit", "K")):
        savemat(path / "m.mat", MATRICES | {name: value})
        with pytest.raises(ModelError, match=name if name != "OutputUnit" else "'K'"):
            rs.load_model(path / "m.mat")
    savemat(path / "m.mat", MATRICES | {"StateName": cells("a", "b")})
    with pytest.warns(NotCarried, match="StateName"):
        rs.load_model(path / "m.mat")


def law_of_matlab(path):
    """Channels in another order are put in order, units are read, delays are refused."""
    gain = np.array([[1.0, 2.0], [3.0, 4.0]])
    own = {"A": np.zeros((2, 2)), "B": np.eye(2), "C": np.eye(2), "D": gain, "Ts": 2e-4}
    savemat(path / "l.mat", own | {"InputName": cells("disc_y", "disc_x"), "InputUnit": cells("um", "um")})
    law = rs.load_law(path / "l.mat")
    assert law.D[0, 0] == pytest.approx(gain[:, ::-1] * 1e6)
    savemat(path / "l.mat", own | {"OutputDelay": [[1.0], [0.0]]})
    with pytest.raises(LawError, match="OutputDelay"):
        rs.load_law(path / "l.mat")


def system_of_control(path):
    control = pytest.importorskip("control")
    system = control.ss(-np.eye(2), np.eye(2), np.eye(2), 0, 1e-4)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        rs.LinearModel.from_control(system)
    system.x0 = np.ones(2)
    for convert in (rs.LinearModel.from_control, lambda one: rs.LpvModel.from_control({(0.0, 0.0): one}, 0)):
        with pytest.warns(NotCarried, match="x0"):
            convert(system)


def rotor_of_ross(path):
    """The rotors themselves are tested with fe_shaft; here that an unknown property is named and damping refused."""
    from fe_shaft import Rotor

    stuff = SimpleNamespace(name="steel", rho=7810.0, E=211e9, G_s=81.2e9)
    shaft = SimpleNamespace(
        n=0, L=0.5, idl=0.0, odl=0.05, idr=0.0, odr=0.05, material=stuff, shear_effects=True, rotary_inertia=True,
        gyroscopic=True, crack=0.1,
    )  # fmt: skip
    parts = {"disk_elements": [], "bearing_elements": [], "point_mass_elements": []}
    with pytest.warns(NotCarried, match="crack"):
        Rotor.from_ross(SimpleNamespace(shaft_elements=[shaft], **parts))
    with pytest.raises(ShaftError, match="modal_damping_ratio"):
        Rotor.from_ross(SimpleNamespace(shaft_elements=[shaft], modal_damping_ratio=[0.01], **parts))


def marked_texts(path):
    """A byte order mark before TOML, JSON and CSV is no part of them."""
    machine = path / "machine.toml"
    machine.write_text("\ufeff" + rs.machine_text("plain_rotor"), encoding="utf-8")
    assert rs.load_machine(str(machine)).name == "plain_rotor"
    model = rs.LinearModel(-np.eye(2), np.eye(2), np.eye(2), np.zeros((2, 2)))
    model.save(path / "model.json")
    (path / "model.json").write_text("\ufeff" + (path / "model.json").read_text(), encoding="utf-8")
    assert rs.load_model(path / "model.json").order == 2
    mapping = (
        '\ufeff[channels.disc_measured]\nx = {column = "X", unit = "um"}\ny = {column = "Y", unit = "um"}\n[time]\n'
    )
    (path / "mapping.toml").write_text(mapping + 'column = "t"\nunit = "s"\n', encoding="utf-8")
    both(idn.read(csv(path / "a.csv", ["t", "X", "Y"], T, MICRO, MICRO, encoding="utf-8-sig"), path / "mapping.toml"))


def balancing_table(path):
    """A cell without a heading is named, a byte order mark is none of the first name."""
    from rotorsim.balance import read_conditions

    mapping = {
        "conditions": {"column": "id"}, "speed": {"column": "rpm"},
        "readings": {"p": {"real": "a", "imaginary": "b", "unit": "um"}},
        "planes": {"disc": {"amount": "u", "angle": "w", "unit": "g*mm"}},
    }  # fmt: skip
    (path / "a.csv").write_text("\ufeffid,rpm,a,b,u,w\nbare,1000,1,2,0,0\n", encoding="utf-8")
    assert read_conditions([path / "a.csv"], mapping).labels == ("bare",)
    (path / "a.csv").write_text("id,rpm,a,b,u,w\nbare,1000,1,2,0,0,7\n", encoding="utf-8")
    with pytest.raises(DataError, match="row 2"):
        read_conditions([path / "a.csv"], mapping)


def stored_model(path):
    """An entry of a model's file that is none of a model."""
    rs.LinearModel(-np.eye(2), np.eye(2), np.eye(2), np.zeros((2, 2))).save(path / "model.json")
    content = json.loads((path / "model.json").read_text()) | {"delay": 0.01}
    (path / "model.json").write_text(json.dumps(content))
    with pytest.warns(NotCarried, match="delay"):
        rs.load_model(path / "model.json")


def sampled_at_another_rate(path):
    """Two mapped channels of two rates are refused by name."""
    file = tdms(path / "a.tdms", ("X", MICRO, wave()), ("Y", MICRO, wave(wf_increment=2 * TS)))
    with pytest.raises(idn.ReadError, match=r"disc_measured\.(x|y) is sampled every"):
        idn.read(file, mapped())


CASES = [
    tdms_late, tdms_offset, tdms_start_of_one_unknown, tdms_ends, tdms_part_of_a_sample, tdms_no_common_time,
    tdms_unmapped, tdms_setting, tdms_properties, tdms_unit, sampled_at_another_rate, uff_late, uff_padded,
    uff_unmapped, uff_unit_of_time, uff_unit_system, uff_byte_order_mark, csv_pairs_of_time, csv_latin,
    csv_stated_encoding, csv_wide_and_marked, csv_texts, csv_unit_row, mat_own_times, mat_left_out, hdf5_late,
    hdf5_scales, hdf5_groups_of_times, arrays_with_units, frame_of_pandas, model_of_matlab, law_of_matlab,
    system_of_control, rotor_of_ross, marked_texts, balancing_table, stored_model,
]  # fmt: skip


def test_there_are_thirty_of_them():
    assert len(CASES) >= 30


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.__name__)
def test_nothing_is_dropped_without_a_sentence(case, tmp_path):
    case(tmp_path)
