% A law as C on a dSPACE board: an S-function of its source, built for the real-time interface of the board.
%
%   rotorsim fmu export --law hinf.json --c-only --out hinf
%
% The S-function calls two functions of a small file, which keeps the memory of the law and takes it by address.
fid = fopen('hinf_block.h', 'w');
fprintf(fid, 'void hinf_block_start(void);\n');
fprintf(fid, 'void hinf_block_step(double *measured, double speed, double pressure, double angle, double *reference);\n');
fclose(fid);
fid = fopen('hinf_block.c', 'w');
fprintf(fid, '#include "hinf.h"\n#include "hinf_block.h"\n\nstatic hinf_memory law;\n\n');
fprintf(fid, 'void hinf_block_start(void) { hinf_reset(&law); }\n\n');
fprintf(fid, 'void hinf_block_step(double *measured, double speed, double pressure, double angle, double *reference) {\n');
fprintf(fid, '    hinf_step(&law, measured, speed, pressure, angle, reference);\n}\n');
fclose(fid);

block = legacy_code('initialize');
block.SFunctionName = 'hinf_block_sfun';
block.HeaderFiles = {'hinf.h', 'hinf_block.h'};
block.SourceFiles = {'hinf.c', 'hinf_block.c'};
block.StartFcnSpec = 'void hinf_block_start(void)';
block.OutputFcnSpec = 'void hinf_block_step(double u1[2], double u2, double u3, double u4, double y1[2])';
block.SampleTime = 2e-4;
legacy_code('sfcn_cmex_generate', block);
legacy_code('compile', block);
legacy_code('sfcn_tlc_generate', block);
legacy_code('rtwmakecfg_generate', block);

model = 'law_on_board';
new_system(model);
legacy_code('slblock_generate', block, model);
set_param(model, 'SolverType', 'Fixed-step', 'FixedStep', '2e-4', 'StopTime', 'inf');
set_param(model, 'SystemTargetFile', 'rti1202.tlc'); % MicroLabBox; the blocks of its converters are yours to connect
save_system(model);
