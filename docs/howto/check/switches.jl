# Switches of the capsule by DifferentialEquations.jl, restarted at each event: writes switches.csv.
using DifferentialEquations

const omega, delta, zeta, beta, gamma, f_b = 0.8, 0.02, 0.05, 1.5, 3.3, 1.0
const FIELDS = Dict((0, 1) => 1, (0, 0) => 2, (0, -1) => 3, (1, 1) => 4, (1, 0) => 5, (1, -1) => 6)

force(u, contact) = u[1] + 2 * zeta * u[2] + contact * beta * (u[1] - delta)

function rates!(du, u, p, t)
    alpha, contact, drift = p
    pull = force(u, contact)
    slip = drift == 0 ? 0.0 : (pull - drift * f_b) / gamma
    du[1], du[2], du[3] = u[2], alpha * cos(omega * t) - pull - slip, slip
end

function guards(u, contact, drift)
    gap = (2contact - 1) * (u[1] - delta)
    drift == 0 || return [gap, drift * u[3], 1.0]
    pull = force(u, contact)
    return [gap, f_b - pull, f_b + pull]
end

function switches(alpha, tolerance, tend)
    t, u, contact, drift, found = 0.0, zeros(3), 0, 0, Tuple{Float64,Int}[]
    while t < tend
        fired = Ref(0)
        # The third argument is called where a condition falls through zero.
        callback(k) = ContinuousCallback(
            (u, t, integrator) -> guards(u, contact, drift)[k],
            nothing,
            integrator -> (fired[] = k; terminate!(integrator)),
        )
        problem = ODEProblem(rates!, u, (t, tend), (alpha, contact, drift))
        solution = solve(problem, Vern9(); reltol = tolerance, abstol = tolerance,
                         callback = CallbackSet(callback(1), callback(2), callback(3)))
        fired[] == 0 && break
        t, u = solution.t[end], copy(solution.u[end])
        if fired[] == 1
            contact, u[1] = 1 - contact, delta
        elseif drift != 0
            pull, u[3] = force(u, contact), 0.0
            drift = abs(pull) <= f_b ? 0 : Int(sign(pull))
        else
            drift = fired[] == 2 ? 1 : -1
        end
        push!(found, (t, FIELDS[(contact, drift)]))
    end
    return found
end

tolerance, tend = 1e-9, 20 * 2pi / omega
open("switches.csv", "w") do file
    println(file, "# alpha = 0.7\n# end = $tend\n# tolerance = $tolerance\ntime,entered")
    for (time, field) in switches(0.7, tolerance, tend)
        println(file, "$time,F$field")
    end
end
