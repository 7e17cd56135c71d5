% A plant and a law as units in Simulink, sampled at 5 kHz.
%
%   rotorsim fmu export dtu_gas_bearing --fmi 2 --out rig.fmu
%   rotorsim fmu export --law hinf.json --fmi 2 --out law.fmu
model = 'rotor_loop';
sample = '2e-4';
new_system(model);
set_param(model, 'SolverType', 'Fixed-step', 'Solver', 'FixedStepDiscrete', 'FixedStep', sample, 'StopTime', '0.1');
plant = [model '/plant'];
law = [model '/law'];
add_block('simulink_extras/FMU Import/FMU', plant, 'FMUName', fullfile(pwd, 'rig.fmu'));
add_block('simulink_extras/FMU Import/FMU', law, 'FMUName', fullfile(pwd, 'law.fmu'));

% Ports by the names of the variables: the order of ports is that of modelDescription.xml.
inputs = {'shaft.speed_ref', '300'; 'injection.pressure', '0.3e6'; 'disc.force_x', '0'; 'disc.force_y', '0'; 'drive.on', '1'};
sources = ports_of('rig.fmu', 'input');
seen = ports_of('rig.fmu', 'output');
for k = 1:size(inputs, 1)
    name = sprintf('input_%d', k);
    add_block('simulink/Sources/Constant', [model '/' name], 'Value', inputs{k, 2}, 'SampleTime', sample);
    if strcmp(inputs{k, 1}, 'drive.on')
        set_param([model '/' name], 'OutDataTypeStr', 'boolean');
    end
    add_line(model, [name '/1'], sprintf('plant/%d', find(strcmp(sources, inputs{k, 1}))));
end
wanted = ports_of('law.fmu', 'input');
given = ports_of('law.fmu', 'output');
for k = 1:numel(wanted)
    add_line(model, sprintf('plant/%d', find(strcmp(seen, wanted{k}))), sprintf('law/%d', k));
end
for axis = 'xy'
    name = ['piezo.ref_' axis];
    add_line(model, sprintf('law/%d', find(strcmp(given, name))), sprintf('plant/%d', find(strcmp(sources, name))));
end
save_system(model);
results = sim(model);

function names = ports_of(file, causality)
% Names of the scalar variables of a causality, in their order in the description.
    folder = tempname;
    unzip(file, folder);
    variables = xmlread(fullfile(folder, 'modelDescription.xml')).getElementsByTagName('ScalarVariable');
    names = {};
    for k = 0:variables.getLength - 1
        if strcmp(char(variables.item(k).getAttribute('causality')), causality)
            names{end + 1} = char(variables.item(k).getAttribute('name')); %#ok<AGROW>
        end
    end
end
