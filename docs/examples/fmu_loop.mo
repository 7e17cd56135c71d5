package RotorOnGas "A rotor on a gas bearing and its control law, sampled at 5 kHz"
  constant Real period(unit = "s") = 2e-4 "Communication step of both units";

  connector RealInput = input Real;
  connector RealOutput = output Real;

  partial block Plant "Signals of a plant's unit; extend it by the model that a tool makes of the .fmu file"
    RealInput speed_ref(unit = "rad/s") "shaft.speed_ref";
    RealInput pressure(unit = "Pa") "injection.pressure, gauge";
    RealInput ref[2](each unit = "V") "piezo.ref_x, piezo.ref_y";
    RealInput force[2](each unit = "N") "disc.force_x, disc.force_y";
    RealOutput disc[2](each unit = "m") "meas.disc_x, meas.disc_y";
    RealOutput speed(unit = "rad/s") "meas.speed";
    RealOutput supply(unit = "Pa") "meas.pressure";
  end Plant;

  partial block Law "Signals of a law's unit"
    RealInput disc[2](each unit = "m") "meas.disc_x, meas.disc_y";
    RealInput speed(unit = "rad/s") "meas.speed";
    RealInput supply(unit = "Pa") "meas.pressure";
    RealOutput ref[2](each unit = "V") "piezo.ref_x, piezo.ref_y";
  end Law;

  block Proportional "A law of two gains in place of a unit"
    extends Law;
    parameter Real gain(unit = "V/m") = 2e4 "Reference over displacement";
  equation
    when sample(0, RotorOnGas.period) then
      ref = gain * disc;
    end when;
  end Proportional;

  model Loop "Plant and law; a hit on the disc after 50 ms"
    replaceable Plant plant "Redeclare it as the imported unit";
    replaceable Proportional law constrainedby Law "Redeclare it as the imported unit of a law";
    parameter Real start(unit = "rad/s") = 300 "Speed at the start";
    parameter Real supply(unit = "Pa") = 3e5 "Supply, gauge";
  equation
    plant.speed_ref = start;
    plant.pressure = supply;
    plant.force = {if time >= 0.05 and time < 0.05 + RotorOnGas.period then 20 else 0, 0};
    connect(plant.disc, law.disc);
    connect(plant.speed, law.speed);
    connect(plant.supply, law.supply);
    connect(law.ref, plant.ref);
  end Loop;
end RotorOnGas;
