%CAPSULE_SIMULATE  Run the exact map of the capsule system, each switch certified to be the first.
%   r = CAPSULE_SIMULATE(p, periods) runs the parameters p, a struct with the scalar fields that
%   capsule_interface.h declares, for so many excitation periods, from rest at time 0.
%   r = CAPSULE_SIMULATE(p, periods, state, phase) starts from state = [x_r, v_r, v_c] at a time
%   phase in [0, 2*pi/omega). All quantities are dimensionless. r has the fields
%
%      status    'done', or 'open' where neither double precision nor 106 bits could decide the next
%                switch: the run ends there
%      period    whole excitation periods passed
%      final     [x_r, v_r, v_c, x_c] at the end
%      segments  a struct of columns, one row a segment: field (from 1 on), source and target (the
%                switching planes from 1 on, 0 for none), outcome, time and duration, start and end
%                ([x_r, v_r, v_c]), x_c at its start, and its advance
%
%   r = CAPSULE_SIMULATE(p, periods, state, phase, times) has r.y as well: a row [x_r, v_r, v_c, x_c]
%   for each time, from the closed form, never by interpolation.
%
%   It is a MEX file: CAPSULE_BUILD compiles it for a scene.
%
%   See also CAPSULE_MANY, CAPSULE_BUILD.
