% Switches of the capsule by ode45, restarted at each event: writes switches.csv.
function switches_ode45(tolerance, periods)
  if nargin < 1, tolerance = 1e-9; end
  if nargin < 2, periods = 20; end
  p = struct('alpha', 0.7, 'omega', 0.8, 'delta', 0.02, 'zeta', 0.05, ...
             'beta', 1.5, 'gamma', 3.3, 'f_b', 1.0);
  fields = [3 2 1; 6 5 4];  % by contact (0, 1) and drift (-1, 0, 1)
  t = 0; y = [0; 0; 0]; contact = 0; drift = 0;
  tend = periods * 2 * pi / p.omega;
  file = fopen('switches.csv', 'w');
  fprintf(file, '# alpha = %.17g\n# end = %.17g\n', p.alpha, tend);
  fprintf(file, '# tolerance = %g\ntime,entered\n', tolerance);
  while t < tend
    options = odeset('RelTol', tolerance, 'AbsTol', tolerance, ...
                     'Events', @(t, y) guards(y, p, contact, drift));
    [~, ~, te, ye, ie] = ode45(@(t, y) rates(t, y, p, contact, drift), [t tend], y, options);
    if isempty(te) || te(end) >= tend, break, end
    t = te(end); y = ye(end, :)'; fired = ie(end);
    if fired == 1
      contact = 1 - contact; y(1) = p.delta;
    elseif drift ~= 0
      pull = force(y, p, contact); y(3) = 0;
      drift = sign(pull) * (abs(pull) > p.f_b);
    elseif fired == 2
      drift = 1;
    else
      drift = -1;
    end
    fprintf(file, '%.17g,F%d\n', t, fields(contact + 1, drift + 2));
  end
  fclose(file);
end

function pull = force(y, p, contact)
  pull = y(1) + 2 * p.zeta * y(2) + contact * p.beta * (y(1) - p.delta);
end

function dy = rates(t, y, p, contact, drift)
  pull = force(y, p, contact);
  slip = (drift ~= 0) * (pull - drift * p.f_b) / p.gamma;
  dy = [y(2); p.alpha * cos(p.omega * t) - pull - slip; slip];
end

function [value, terminal, direction] = guards(y, p, contact, drift)
  gap = (2 * contact - 1) * (y(1) - p.delta);
  if drift ~= 0
    value = [gap; drift * y(3); 1];
  else
    pull = force(y, p, contact);
    value = [gap; p.f_b - pull; p.f_b + pull];
  end
  terminal = [1; 1; 1];
  direction = [-1; -1; -1];
end
