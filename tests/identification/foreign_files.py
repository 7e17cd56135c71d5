"""Forty files named by others: headings as loggers, manuals and public data sets have them, over one simulated rig.

Names and layouts are those of the sources below, not of this project; the numbers are a rotor's: 1X orbits, pulses of a
keyphasor, ramps, gap voltages, blows, temperatures.

Sources of names and layouts: fordatis.fraunhofer.de/handle/fordatis/151.2 (V_in, Measured_RPM, Vibration_1); MAFAULDA,
smt.ufrj.br (eight columns without heading); Case Western bearing data center (DE_time, FE_time, RPM); KAt data center
Paderborn (force, phase_current_1, speed, temp_2_bearing_module, torque, vibration_1); Curtin University bearing data
(Channel_1 Radial Bearing Housing Acceleration, Channel_2 Tacho - once per revolution pulse); VBL-VA001, zenodo 7006575;
specification of the LabVIEW measurement file (ni.com/tutorial/4139); NI SignalExpress and FlexLogger; Keysight
InfiniiVision 2000 X (CSV structure), LeCroy 9300C appendix E, R&S RTM20, Tektronix and PicoScope exports; Yokogawa
DL9140 appendix 5; dydaqmeas MEAS_FORMAT; MMF VM-REC header (mmf.de); Beckhoff TwinCAT Scope CSV; HBM catman and
QuantumX; Dewesoft X export; B&K PULSE and BK Connect; Bently Nevada ADRE and System 1 (1YD, 1XD, KPH); Siemens Testlab
points; OROS (French); imc FAMOS and Gantner (German); channels of AnalysiereEO_3SensorenJM (Zeit, Tacho, Winkel, Kraft
GL); Danish, French, Spanish and Swedish terms of ISO 2041.
"""

import numpy as np

RATE, COUNT = 12800, 12800
FREQUENCY = 47.3
T = np.arange(COUNT) / RATE


def signals(ramp: bool = False, seed: int = 0) -> dict[str, np.ndarray]:
    """Signals (n,) of a rig by name; displacements in um."""
    rng = np.random.default_rng(seed)
    noise = lambda size: size * rng.standard_normal(COUNT)  # noqa: E731
    f = FREQUENCY * np.ones(COUNT) if not ramp else 20 + 40 * T / T[-1]
    phi = 2 * np.pi * np.cumsum(f) / RATE + 1.0
    x = 30 * np.cos(phi - 0.4) + 4 * np.cos(2 * phi) + noise(0.3)
    y = 24 * np.sin(phi - 0.5) + 3 * np.sin(2 * phi) + noise(0.3)
    a, b = (x + y) / np.sqrt(2), (y - x) / np.sqrt(2)
    blow = np.zeros(COUNT)
    for start in (2000, 7000):
        blow[start : start + 12] = 180 * np.sin(np.pi * np.arange(12) / 11)
    ring = np.zeros(COUNT)
    for start in (2000, 7000):
        t = T[: COUNT - start]
        ring[start:] += 25 * np.exp(-40 * t) * np.sin(2 * np.pi * 140 * t)
    turn = phi % (2 * np.pi)
    return {
        "t": T, "x": x, "y": y, "a": a, "b": b, "x2": 0.6 * x + noise(0.3), "y2": 0.7 * y + noise(0.3),
        "a2": 0.5 * a + noise(0.3), "b2": 0.8 * b + noise(0.3),
        "key": np.where(turn < 0.25, -8.4, -1.1) + noise(0.03), "ttl": np.where(turn < 0.5, 4.8, 0.1) + noise(0.02),
        "half": np.where(turn < np.pi, 5.0, 0.0), "rpm": 60 * f + noise(0.4), "hz": f + noise(0.004),
        "rad": 2 * np.pi * f + noise(0.03), "const_rpm": np.round(60 * f),
        "acc": 1.2 * np.cos(phi) + 0.4 * np.cos(7.3 * phi) + noise(0.5), "acc2": 0.8 * np.sin(phi) + noise(0.6),
        "acc3": 0.2 * np.sin(phi) + noise(0.3), "vel": 3.1 * np.cos(phi) + noise(0.2), "blow": blow + noise(0.15),
        "ring_x": x + ring, "ring_y": y + 0.05 * ring, "bar": 4.1 + noise(0.003), "temp": 41 + 2 * T + noise(0.02),
        "amp": 2.2 * np.sin(2 * np.pi * 50 * T) + noise(0.05), "torque": 1.3 + noise(0.02), "mic": noise(0.02),
        "index": np.arange(COUNT), "load": 998 + noise(1.0), "zero": np.zeros(COUNT),
        "u": np.where(rng.random(COUNT // 64 + 1) > 0.5, 2.0, -2.0).repeat(64)[:COUNT], "volt_in": 4.7 + noise(0.01),
        "v": np.where(rng.random(COUNT // 64 + 1) > 0.5, 2.0, -2.0).repeat(64)[:COUNT],
        "angle": np.rad2deg(turn), "flow": 22 + noise(0.05),
    }  # fmt: skip


TRUTH = {
    "t": "time", "key": "keyphasor", "ttl": "keyphasor", "half": "keyphasor", "rpm": "speed", "hz": "speed",
    "rad": "speed", "const_rpm": "speed", "acc": "acceleration", "acc2": "acceleration", "acc3": "acceleration",
    "vel": "velocity", "blow": "force", "bar": "pressure", "u": "reference", "v": "reference", "angle": "angle",
} | dict.fromkeys(("x", "y", "a", "b", "x2", "y2", "a2", "b2", "ring_x", "ring_y"), "probe")  # fmt: skip
"""Kind of a signal; those that are not here are none of a record."""
UNITS = {"um": 1.0, "µm": 1.0, "mm": 1e-3, "mil": 1 / 25.4, "mils": 1 / 25.4, "gap": 7.87e-3, "V": 7.87e-3}
"""Numbers of a displacement per um; 'gap' is a voltage about -10 V."""
# name: (delimiter, lines above the heading, heading or None, units or None, columns)
# a column is signal or signal:scale in the file's own unit; the truth of the unit stands behind a slash
FILES: dict[str, tuple[str, list[str], list[str] | None, list[str] | None, str]] = {
    "fordatis": (
        ",",
        [],
        ["V_in", "Measured_RPM", "Vibration_1", "Vibration_2", "Vibration_3"],
        None,
        "volt_in rpm/rpm acc acc2 acc3",
    ),
    "mafaulda": (",", [], None, None, "ttl acc acc2 acc3 acc acc2 acc3 mic"),
    "cwru": (";", [], ["X097_DE_time", "X097_FE_time", "X097RPM"], None, "acc acc2 const_rpm/rpm"),
    "paderborn": (
        ";",
        [],
        [
            "time",
            "force",
            "phase_current_1",
            "phase_current_2",
            "speed",
            "temp_2_bearing_module",
            "torque",
            "vibration_1",
        ],
        ["s", "N", "A", "A", "rpm", "°C", "Nm", "V"],
        "t/s load amp amp rpm/rpm temp torque acc",
    ),
    "curtin": (
        "\t",
        ["Sampling frequency\t51200 Hz", "Channel_1\tRadial Bearing Housing Acceleration (m/s^2)"],
        ["Radial Bearing Housing Acceleration (m/s^2)", "Tacho - once per revolution pulse (Volts)"],
        None,
        "acc/m/s^2 ttl/V",
    ),
    "vbl": (",", [], ["Time", "X (g)", "Y (g)", "Z (g)"], None, "t/s acc/g acc2/g acc3/g"),
    "labview": (
        "\t",
        [
            "LabVIEW Measurement",
            "Writer_Version\t2",
            "***End_of_Header***",
            "",
            "Delta_X\t7.8125E-5\t7.8125E-5\t7.8125E-5",
            "***End_of_Header***",
        ],
        ["X_Value", "Keyphasor", "Prox X", "Prox Y", "Comment"],
        None,
        "t/s key x:gap y:gap",
    ),
    "labview_untitled": (
        "\t",
        ["Delta_X\t7.8125E-5\t7.8125E-5"],
        ["X_Value", "Untitled", "Untitled 1", "Untitled 2"],
        None,
        "t/s key x:gap y:gap",
    ),
    "signalexpress": (
        "\t",
        [],
        ["Time - Dev1_ai0", "Dev1_ai0 (Volts)", "Dev1_ai1 (Volts)", "Dev1_ai2 (Volts)"],
        None,
        "t/s ttl/V a:gap b:gap",
    ),
    "flexlogger": (
        ",",
        [],
        ["Time (s)", "Accel DE Horizontal (g)", "Accel DE Vertical (g)", "Tachometer (RPM)"],
        None,
        "t/s acc/g acc2/g rpm/rpm",
    ),
    "keysight": (",", [], ["x-axis", "1", "2"], ["second", "Volt", "Volt"], "t/s x:gap key/V"),
    "lecroy": (",", ["LECROY9354,935412345", "Segments,1,SegmentSize,12800"], ["Time", "Ampl"], None, "t/s key"),
    "rtm": (",", [], ["in s", "CH1 in V", "CH2 in V"], None, "t/s key/V x:gap"),
    "tektronix": (
        ",",
        ["Model,MSO24", "Sample Interval,7.8125E-05", "Record Length,12800", ""],
        ["TIME", "CH1", "CH2", "CH3"],
        None,
        "t/s x:gap y:gap key",
    ),
    "picoscope": (
        ",",
        [],
        ["Time", "Channel A", "Channel B", "Channel C"],
        ["(ms)", "(V)", "(V)", "(V)"],
        "t:1e3/ms a:gap b:gap ttl/V",
    ),
    "yokogawa": (
        ",",
        ["HResolution,7.8125E-05", "HUnit,s"],
        ["Time", "KPH", "BRG1 X", "BRG1 Y"],
        ["s", "V", "V", "V"],
        "t/s key/V x:gap y:gap",
    ),
    "dydaqmeas": (
        ";",
        [],
        ["Laufzeit", "Wegsensor X", "Wegsensor Y", "Drehzahl", "Lagertemperatur"],
        ["s", "µm", "µm", "1/min", "°C"],
        "t/s x/um y/um rpm/rpm temp",
    ),
    "vmrec": (
        ";",
        ["SampleRate=12800", "InputName_1=Lager 12", "MeasurandName_1=acceleration"],
        ["Lager 12 Beschleunigung", "Lager 14 Beschleunigung"],
        ["m/s²", "m/s²"],
        "acc/m/s^2 acc2/m/s^2",
    ),
    "beckhoff": (
        "\t",
        ["Name\tScope Project", "SampleTime[ms]\t0.078125"],
        ["Zeit [ms]", "fPositionX [um]", "fPositionY [um]", "fActSpeed [rpm]"],
        None,
        "t:1e3/ms x/um y/um rpm/rpm",
    ),
    "catman": (
        "\t",
        ["HBM_CATMAN_DATAFILE", "Prüfer\tGroß", "Anzahl Kanäle\t5"],
        [
            "Zeit  1 - Standardmessrate [s]",
            "Wellenweg horizontal [µm]",
            "Wellenweg vertikal [µm]",  # codespell:ignore
            "Phasengeber [V]",
            "Versorgungsdruck [bar]",
        ],
        None,
        "t/s x/um y/um key/V bar/bar",
    ),
    "quantumx": (
        ";",
        ["Gerät;QuantumX MX410", "Abtastrate;12800"],
        ["Zeit", "Impulshammer", "Wegaufnehmer X", "Wegaufnehmer Y"],
        ["s", "N", "µm", "µm"],
        "t/s blow/N ring_x/um ring_y/um",
    ),
    "dewesoft": (
        "\t",
        ["Data header", "Sample rate: 12800 Hz", ""],
        ["Time (s)", "Keyphasor (V)", "DE-X (um)", "DE-Y (um)", "Tacho/Frequency (Hz)", "T_oil (°C)"],
        None,
        "t/s key/V x/um y/um hz/Hz temp",
    ),
    "pulse_hammer": (
        "\t",
        ["Brüel & Kjær PULSE"],
        ["Time [s]", "8206 Hammer Y [N]", "4507 DE +X [m/s²]", "4507 DE +Y [m/s²]"],
        None,
        "t/s blow/N acc/m/s^2 acc2/m/s^2",
    ),
    "bkconnect": (
        ",",
        [],
        ["Time (s)", "Tacho 1 (RPM)", "Displacement X (µm)", "Displacement Y (µm)"],
        None,
        "t/s rpm/rpm x/um y/um",
    ),
    "adre": (
        ",",
        ["Point Name:,1YD", "Machine Name:,Rotor Kit"],
        ["Time (ms)", "1YD 45 Left (mil)", "1XD 45 Right (mil)", "KPH (V)"],
        None,
        "t:1e3/ms b/mil a/mil key/V",
    ),
    "adre_planes": (
        ",",
        [],
        ["Time (s)", "KPH (V)", "1YD (um)", "1XD (um)", "2YD (um)", "2XD (um)"],
        None,
        "t/s key/V y/um x/um y2/um x2/um",
    ),
    "system1": (
        ",",
        [],
        ["Time (s)", "IB X (Volts)", "IB Y (Volts)", "OB X (Volts)", "OB Y (Volts)", "Keyphasor (Volts)"],
        None,
        "t/s x:gap y:gap x2:gap y2:gap key/V",
    ),
    "testlab": (
        "\t",
        ["Block Title: Throughput"],
        ["Time s", "Tacho1 rpm", "DEBRG:+X g", "DEBRG:+Y g", "SHAFT:+X um", "SHAFT:+Y um"],
        None,
        "t/s rpm/rpm acc/g acc2/g x/um y/um",
    ),
    "oros": (
        ";",
        [],
        [
            "Temps (s)",
            "Déplacement X (µm)",
            "Déplacement Y (µm)",
            "Vitesse de rotation (tr/min)",
            "Température palier (°C)",
        ],
        None,
        "t/s x/um y/um rpm/rpm temp",
    ),
    "oros_marteau": (
        ";",
        [],
        ["Temps (s)", "Marteau de choc X (N)", "Accéléromètre X (m/s²)", "Top tour (V)"],
        None,
        "t/s blow/N acc/m/s^2 ttl/V",
    ),
    "danish": (
        ";",
        ["Prøve;7;;;;", "Dato;2026-02-03;;;;"],
        [
            "Tid [s]",
            "Forskydning x [µm]",
            "Forskydning y [µm]",
            "Omdrejningstal [o/min]",
            "Forsyningstryk [bar]",
            "Temperatur [°C]",  # codespell:ignore
        ],
        None,
        "t/s x/um y/um rpm/rpm bar/bar temp",
    ),
    "danish_piezo": (
        ";",
        [],
        ["tid_ms", "sensor_x_um", "sensor_y_um", "ref_x_V", "ref_y_V", "tryk_bar", "omdr_rpm"],
        None,
        "t:1e3/ms x/um y/um u/V v/V bar/bar rpm/rpm",
    ),
    "famos": (
        ";",
        ["Messung;12", "Kommentar;Hochlauf"],
        ["Zeit", "Schwingweg_A1_X", "Schwingweg_A1_Y", "n_Welle", "p_Zuluft"],
        ["s", "µm", "µm", "U/min", "bar"],
        "t/s x/um y/um rpm/rpm bar/bar",
    ),
    "gantner": (
        ";",
        [],
        ["Zeit [s]", "Schwinggeschwindigkeit Lager 1 [mm/s]", "Drehzahl [Hz]", "Strom L1 [A]"],
        None,
        "t/s vel/mm/s hz/Hz amp",
    ),
    "balancer": (
        ",",
        [],
        ["Zeit", "Tacho", "Winkel", "Kraft_GL_1", "Weg_1", "Weg_2"],
        ["s", "1/min", "°", "N", "µm", "µm"],
        "t/s rpm/rpm angle/deg load x/um y/um",
    ),
    "mfs_alert": (
        ",",
        [],
        ["Time(s)", "Tach(V)", "Prox-X(mils)", "Prox-Y(mils)", "Motor Current(A)", "Mic"],
        None,
        "t/s ttl/V x/mils y/mils amp mic",
    ),
    "dspace": (
        ";",
        [],
        ["Time", "adc_disp_x_um", "adc_disp_y_um", "enc_omega_rad_s", "dac_piezo_x_V", "dac_piezo_y_V"],
        None,
        "t/s x/um y/um rad/rad/s u/V v/V",
    ),
    "spanish": (
        ";",
        [],
        ["Tiempo (s)", "Desplazamiento X (µm)", "Desplazamiento Y (µm)", "Velocidad (rpm)", "Presión de aire (bar)"],
        None,
        "t/s x/um y/um rpm/rpm bar/bar",
    ),
    "swedish": (
        ";",
        [],
        ["Tid (s)", "Läge X (µm)", "Läge Y (µm)", "Varvtal (varv/min)"],
        None,
        "t/s x/um y/um rpm/rpm",
    ),
    "index": (
        ",",
        [],
        ["Sample", "Time [us]", "Eddy1_X [mm]", "Eddy1_Y [mm]", "Once/rev [V]", "Status"],
        None,
        "index t:1e6/us x/mm y/mm half/V zero",
    ),
}
RAMPS = ("famos", "bkconnect", "dewesoft", "cwru")


def made(name: str) -> tuple[str, list[tuple[str, str]]]:
    """Text of a file, and (kind, unit) of each of its columns; empty for what is no channel or states no unit."""
    delimiter, above, heading, units, columns = FILES[name]
    pool = signals(name in RAMPS, len(name))
    values, truth = [], []
    for word in columns.split():
        body, _, unit = word.partition("/")
        signal, _, scale = body.partition(":")
        column = pool[signal]
        if TRUTH.get(signal) == "probe":
            column = column * UNITS[scale or unit] + (-9.6 - 0.3 * len(values) if scale else 0.0)
            unit = unit or "V"
        elif scale:
            column = column * float(scale)
        values.append(column)
        truth.append((TRUTH.get(signal, ""), unit))
    comma = delimiter == ";"
    rows = [delimiter.join(f"{v:.6g}" for v in row) for row in np.column_stack(values)]
    lines = [*above, *([delimiter.join(heading)] if heading else []), *([delimiter.join(units)] if units else [])]
    return "\n".join([*lines, *(row.replace(".", ",") if comma else row for row in rows)]) + "\n", truth
