-- A motor with inductance, whose iron saturates. The current is a continuous state; the torque stops growing at i_most.
local rd = require "refdyn"
local p = rd.parameters {
  { "J", 0.02, "kg m^2" }, { "c", 0.05, "N m s/rad" }, { "R", 0.8, "ohm" }, { "L", 4e-3, "H" }, { "k", 0.3, "N m/A" },
  { "i_most", 20, "A" }, { "u", 24, "V" },
}

return rd.model {
  name = "motor",
  links = { { "rotor", joint = "psi", mass = 1, inertia = { zz = p.J }, damper = { psi = p.c } } },
  states = function(s)
    return { rd.state { "i", rate = (p.u - p.R * s.states.i - p.k * s.qd.rotor_psi) / p.L, unit = "A" } }
  end,
  forces = function(s) return { rotor_psi = p.k * rd.max(-p.i_most, rd.min(s.states.i, p.i_most)) } end,
  courses = function(s) return { power = p.u * s.states.i } end,
}
