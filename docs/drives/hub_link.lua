-- A flexible link, turned by its hub by 90 degrees in 1 s. The programme is the direction of the tip, the drive a torque on the hub.
-- docs/drives.md explains it.
local rd       = require "refdyn"
local n        = rd.option("n_rfe", 9)                                  -- 9: eight springs; 1: a rigid link
local degree   = rd.option("degree", 9)                                 -- of the time law
local feedback = rd.option("feedback", false)                           -- a controller corrects the torque while it is played
local limit    = rd.option("limit", 4.0)                               -- of the drive [N m]
local p        = rd.parameters {
  { "T", 1, "s" }, { "phi", rd.pi / 2, "rad" }, { "eta", 0, "s" }, { "J", 0.02, "kg m^2" }, { "m_tip", 0.1, "kg" },
  { "Kp", 100, "N m/rad" }, { "Kd", 5, "N m s/rad" },
}

local function miss(s) return rd.atan2(s.points.tip.y, s.points.tip.x) - p.phi * rd.smoothstep(s.t, 0, p.T, degree) end

-- At 1 kHz; the wanted angle and rate are columns of the run that is played, which have the names of these inputs.
local function controller()
  local angle, rate = rd.input("hub_psi", 0, "rad"), rd.input("hub_psi_d", 0, "rad/s")
  return function(s)
    local torque = p.Kp * (angle - s.q.hub_psi) + p.Kd * (rate - s.qd.hub_psi)
    return { rd.sampled { every = 1e-3, inputs = { correction = torque }, name = "controller" } }
  end
end
local correction = feedback and rd.input("correction", 0, "N m")

return rd.model {
  name = "hublink", gravity = { 0, 0, 0 },
  links = {
    { "hub", joint = "psi", mass = 1, inertia = { zz = p.J } },
    { "arm", on = "hub",
      beam = { length = 1, section = rd.rectangle(0.005, 0.03), E = 7e10, nu = 0.33, rho = 2700, eta = p.eta, rfe = n, dofs = "psi" } },
    { "tip", on = "arm.tip", mass = p.m_tip },
  },
  points      = { tip = "tip" },
  constraints = function(s) return { rd.position { miss(s), name = "polar" } } end,
  drives      = { { "hub_psi", limit = limit } },
  courses     = function(s) return { miss = miss(s) } end,
  limits      = function() return { { "aim", column = "miss", from = -0.01, to = 0.01 } } end,
  forces      = feedback and function() return { hub_psi = correction } end or nil,
  events      = feedback and controller() or nil,
}
