-- The motor and load of velocity.lua under a continuous PI controller, with a notch filter (s^2 + w^2) / (s^2 + 2 d w s + w^2).
local rd = require "refdyn"
local p = rd.parameters {
  { "J", 0.02, "kg m^2" }, { "J_load", 0.05, "kg m^2" }, { "k", 60, "N m/rad" }, { "c", 0.02, "N m s/rad" },
  { "Kp", 0.6, "N m s/rad" }, { "Ki", 3, "N m/rad" }, { "f", 10.3, "Hz" }, { "d", 0.7, "1" }, { "wish", 5, "rad/s" },
}
local w = 2 * rd.pi * p.f

local function wanted(s) return p.Kp * (p.wish - s.qd.motor_psi) + p.Ki * s.states.sum end
local function torque(s) return wanted(s) - 2 * p.d * w * s.states.n2 end

return rd.model {
  name = "continuous",
  links = {
    { "motor", joint = "psi", mass = 1, inertia = { zz = p.J } },
    { "load", on = "motor", joint = "psi", mass = 1, inertia = { zz = p.J_load }, spring = { psi = p.k }, damper = { psi = p.c } },
  },
  states = function(s)
    return {
      rd.state { "sum", rate = p.wish - s.qd.motor_psi, unit = "rad" },
      rd.state { "n1", rate = s.states.n2 },
      rd.state { "n2", rate = wanted(s) - 2 * p.d * w * s.states.n2 - w^2 * s.states.n1 },
    }
  end,
  forces = function(s) return { motor_psi = torque(s) } end,
  courses = function(s) return { torque = torque(s) } end,
}
