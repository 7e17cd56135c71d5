// The numbers of a frame as people read them.
export function readings(frame, rig) {
  const { now, status } = frame, found = [];
  const add = (name, said, alarm = false) => found.push({ name, said, alarm });
  add("time", `${frame.time.toFixed(2)} s`);
  add("real-time factor", status.factor.toFixed(2));
  if (!now) return found;
  add("speed", `${now.speed.toFixed(0)} rpm`);
  add("swing x, y", `${now.swing[0].toFixed(1)}, ${now.swing[1].toFixed(1)} um 0-pk`);
  if (rig.clearance) {
    add("pressure", `${now.pressure.toFixed(3)} MPa`);
    add("least film", `${now.h_min.toFixed(1)} um`, now.h_min < 2);
    add("contact", now.contact ? "TOUCHES" : "none", now.contact);
    add("air", `${now.mass_flow.toFixed(3)} g/s`);
  }
  add("last hit", ringdown(status.reading));
  add("eigenvalue", modes(status.modes), status.modes[1].some((z) => z < 0));
  if (status.stopped) add("stopped", status.stopped, true);
  return found;
}

function ringdown([axis, frequency, zeta, why]) {
  if (!axis) return "not yet";
  return why ? `${axis}: ${why}` : `${axis}: ${frequency.toFixed(1)} Hz, zeta ${zeta.toFixed(3)}`;
}

function modes([frequency, zeta, why]) {
  if (why) return why;
  return frequency.map((f, i) => `${"xy"[i]}: ${f.toFixed(1)} Hz, zeta ${zeta[i].toFixed(3)}`).join("; ") || "...";
}
