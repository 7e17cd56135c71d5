// The numbers of a frame as displayed text.
export function readings(frame, rig) {
  const { now, status } = frame, found = [];
  const add = (name, text, alarm = false) => found.push({ name, text, alarm });
  add("time", `${frame.time.toFixed(2)} s`);
  add("real-time factor", status.factor.toFixed(2));
  if (!now) return found;
  add("speed", `${now.speed.toFixed(0)} rpm`);
  const beyond = rig.safety > 0 && now.away > rig.safety;
  const swing = now.no_swing || `${now.swing[0].toFixed(1)}, ${now.swing[1].toFixed(1)} um 0-pk`;
  add("swing x, y", beyond ? `${swing}, beyond the safety circle: ${now.away.toFixed(1)} um` : swing, beyond);
  if (rig.clearance) {
    add("pressure", `${now.pressure.toFixed(3)} MPa`);
    add("least film", `${now.h_min.toFixed(1)} um`, now.h_min < 2);
    add("contact", now.contact ? "TOUCHES" : "none", now.contact);
    add("air", `${now.mass_flow.toFixed(3)} g/s`);
  }
  for (const [name, text] of now.probes) add(`probe ${name}`, `${text} 0-pk`);
  add("last hit", ringdown(status.reading));
  const { modes } = status;
  add(modes.open ? "eigenvalue without controller" : "eigenvalue", eigenvalue(modes), !modes.why && (modes.growing.length > 0 || modes.zeta.some((z) => z < 0)));
  if (status.checking) add("controller", `${status.checking} is being checked`);
  if (status.alarm) add("controller", status.alarm, true);
  if (status.stopped) add("stopped", status.stopped, true);
  return found;
}

function ringdown({ axis, frequency, frequency_scatter, zeta, zeta_scatter, why }) {
  if (why) return why;
  return `${axis}: ${frequency.toFixed(1)} ± ${frequency_scatter.toFixed(1)} Hz, zeta ${zeta.toFixed(4)} ± ${zeta_scatter.toFixed(4)}`;
}

function eigenvalue({ frequency, zeta, growing, all, speed, pressure, why }) {
  if (why) return why;
  const point = pressure === undefined ? `${speed} rpm` : `${speed} rpm, ${pressure.toFixed(2)} MPa`;
  const axes = frequency.map((f, i) => `${"xy"[i]}: ${f.toFixed(1)} Hz, zeta ${zeta[i].toFixed(3)}`);
  const another = growing.length ? [growing[0] === 0 ? "the rotor leaves its place without oscillation" : `another mode grows: ${growing[0].toFixed(1)} Hz, zeta ${growing[1].toFixed(3)}`] : [];
  const others = all || growing.length ? [] : ["other modes not known"];
  return `${[...axes, ...another, ...others].join("; ")} at ${point}`;
}
