-- The motor with a load on a flexible shaft, held at rest by a linear quadratic regulator that knows the angle of the motor alone
-- and observes the rest. Its gains come from lqr.py, as gains.lua. docs/controllers.md explains it.
local rd = require "refdyn"
local p  = rd.parameters { { "J_motor", 0.02, "kg m^2" }, { "J_load", 0.05, "kg m^2" }, { "k", 60, "N m/rad" }, { "c", 0.02, "N m s/rad" } }
local is_controlled = rd.option("control", false)
local torque = rd.input("torque", 0, "N m")
local seen = {}                                                         -- the observed state
for i = 1, 4 do seen[i] = rd.input("seen" .. i, 0, "") end

local function sampled(s)
  local gains = require "gains"
  local u, set = 0, {}
  for i = 1, 4 do u = u - gains.K[i] * seen[i] end
  for i = 1, 4 do                                                       -- the state at the next sample
    local next = gains.B[i] * u + gains.L[i] * (s.q.motor_psi - seen[1])
    for j = 1, 4 do next = next + gains.A[i][j] * seen[j] end
    set["seen" .. i] = next
  end
  set.torque = u
  return { rd.sampled { every = gains.every, inputs = set, name = "regulator" } }
end

return rd.model {
  name = "lqr", gravity = { 0, 0, 0 },
  links = {
    { "motor", joint = "psi", mass = 1, inertia = { zz = p.J_motor }, start = { psi = 0.3 } },
    { "load", joint = "psi", mass = 1, inertia = { zz = p.J_load }, start = { psi = -0.2 } },
  },
  forces = function(s)
    local shaft = p.k * (s.q.load_psi - s.q.motor_psi) + p.c * (s.qd.load_psi - s.qd.motor_psi)
    return { motor_psi = torque + shaft, load_psi = -shaft }
  end,
  courses = function(s) return { encoder = s.q.motor_psi } end,
  events = is_controlled and sampled or nil,
}
