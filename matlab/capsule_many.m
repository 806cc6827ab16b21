%CAPSULE_MANY  Run the exact map at many parameters or from many states, side by side.
%   y = CAPSULE_MANY(P, periods) runs each row of P, the parameters in the order that
%   capsule_interface.h declares, for so many excitation periods from rest at time 0. y has a row
%   [x_r, v_r, v_c, x_c] for each, at the end.
%   y = CAPSULE_MANY(P, periods, states, phases) starts from rows [x_r, v_r, v_c] at times in
%   [0, 2*pi/omega), a column.
%   [y, status] = CAPSULE_MANY(...) tells how each run ended: 0 where all periods are over, 2 where a
%   switch stayed open.
%
%   It is fastest where neighbouring rows share omega, zeta, gamma and the stiffnesses of the stops.
%   It is a MEX file: CAPSULE_BUILD compiles it for a scene.
%
%   See also CAPSULE_SIMULATE, CAPSULE_BUILD.
