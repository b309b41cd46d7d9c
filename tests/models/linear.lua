-- Two arms on a spring-loaded slide, with an input, courses and a row of a chosen level: tests linear models.
local rd = require "refdyn"
local level = rd.option("level", "none", { "none", "position", "velocity", "acceleration", "moved" })
local p = rd.parameters { { "sine", 0, "N m" }, { "omega", 1, "rad/s" } }
local tau = rd.input("tau", 0.3, "N m")

return rd.model {
  name = "linear", gravity = { 0, -9.81, 0 },
  links = {
    { "slide", joint = "x", mass = 2.5, spring = { x = 60 }, damper = { x = 4 } },
    { "arm", on = "slide", joint = { "psi" }, start = { psi = -1.5 }, mass = 1.4, center = { 0.35, 0.02, 0 },
      inertia = { xx = 0.01, yy = 0.05, zz = 0.06 }, damper = { psi = 0.4 } },
    { "fore", on = "arm", at = { 0.8, 0, 0 }, joint = { "psi" }, start = { psi = -0.1 }, mass = 0.7, center = { 0.25, -0.03, 0 },
      inertia = { xx = 0.01, yy = 0.02, zz = 0.03 }, spring = { psi = 7 }, damper = { psi = 0.3 } },
  },
  points = { T = { on = "fore", at = { 0.6, 0.1, 0 } } },
  forces = function(s) return { arm_psi = tau + p.sine * rd.sin(p.omega * s.t) } end,
  courses = function(s)
    return { stretch = s.q.slide_x * s.qd.fore_psi + s.points.T.x ^ 2, pull = 2 * tau + s.points.T.yd * rd.sin(s.q.arm_psi) }
  end,
  constraints = function(s)
    local T = s.points.T
    if level == "position" then return { rd.position { T.x - 0.3 * rd.sin(s.q.arm_psi) - 0.1 * s.t } } end
    if level == "velocity" then return { rd.velocity { T.xd - 0.4 * s.q.arm_psi * s.qd.slide_x - 0.2 } } end
    if level == "acceleration" then return { rd.acceleration { T.xdd - 0.5 * s.qd.arm_psi ^ 2 - tau } } end
    if level == "moved" then return { rd.velocity { T.xd - tau } } end
    return {}
  end,
}
