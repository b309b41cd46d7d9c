-- A motor with a load on a flexible shaft under a sampled controller of its rate: PI with a notch filter against the vibration of
-- the shaft, and with a bounded torque. docs/controllers.md explains it.
local rd = require "refdyn"
local p  = rd.parameters {
  { "J_motor", 0.02, "kg m^2" }, { "J_load", 0.05, "kg m^2" }, { "k", 60, "N m/rad" }, { "c", 0.02, "N m s/rad" },
  { "Kp", 0.6, "N m s/rad" }, { "Ki", 3, "N m/rad" }, { "most", 2, "N m" }, { "wish", 5, "rad/s" },
}
local every  = 1e-3
local torque = rd.input("torque", 0, "N m")                             -- what the motor gives
local sum    = rd.input("sum", 0, "rad")                                -- of the error, over time
local n1, n2 = rd.input("n1", 0, "N m"), rd.input("n2", 0, "N m")       -- states of the filter

-- Coefficients of the digital notch filter at f [Hz] with quality Q, from the analogue one by the bilinear transformation.
local function notch(f, Q)
  local w = 2 * rd.pi * f * every
  local a = rd.sin(w) / (2 * Q)
  return { b0 = 1 / (1 + a), b1 = -2 * rd.cos(w) / (1 + a), b2 = 1 / (1 + a), a1 = -2 * rd.cos(w) / (1 + a), a2 = (1 - a) / (1 + a) }
end
local filter = notch(10.3, 0.7)                                         -- `refdyn modes` finds 10.3 Hz

return rd.model {
  name = "velocity", gravity = { 0, 0, 0 },
  links = {
    { "motor", joint = "psi", mass = 1, inertia = { zz = p.J_motor } },
    { "load", joint = "psi", mass = 1, inertia = { zz = p.J_load } },
  },
  forces = function(s)
    local shaft = p.k * (s.q.load_psi - s.q.motor_psi) + p.c * (s.qd.load_psi - s.qd.motor_psi)
    return { motor_psi = torque + shaft, load_psi = -shaft }
  end,
  events = function(s)
    local e = p.wish - s.qd.motor_psi
    local wanted = p.Kp * e + p.Ki * sum
    local filtered = filter.b0 * wanted + n1
    local is_bounded = rd.less(p.most, rd.abs(filtered))                -- then the sum waits
    return { rd.sampled {
      every = every, name = "controller",
      inputs = {
        torque = rd.min(rd.max(filtered, -p.most), p.most), sum = rd.where(is_bounded, sum, sum + every * e),
        n1 = filter.b1 * wanted - filter.a1 * filtered + n2, n2 = filter.b2 * wanted - filter.a2 * filtered,
      },
    } }
  end,
}
