-- Two carts and a turning rod with one row of each level, an input, an anchored parameter and a smooth prescribed motion.
local rd = require "refdyn"
local p = rd.parameters {
  { "stiffness", 41.5, "N/m" }, { "speed", 0.35, "m/s" }, { "alpha", 12.5, "1/s" }, { "beta", 7.25, "1/s" },
}
rd.input("push", 0.75, "N")

return rd.model {
  name = "programme", gravity = { 0.4, -0.3, -9.81 },
  links = {
    { "cart", joint = { "x", "y" }, mass = 3.25, spring = { x = p.stiffness }, damper = { x = 1.35 } },
    { "rod", on = "cart", at = { 0, 0, 0.6 }, joint = { "theta", "z" }, start = { theta = 0.3 },
      mass = 1.15, center = { 0.1, 0.02, -0.55 }, inertia = { xx = 0.21, yy = 0.24, zz = 0.05, xz = 0.01 },
      damper = { theta = 0.15 } },
    { "tip", on = "rod", at = { 0, 0, -1.1 }, turn = { { "x", 0.35 } }, joint = { "phi" }, mass = 0.45,
      center = { 0, 0.07, 0.11 }, inertia = { xx = 0.02, yy = 0.03, zz = 0.04 } },
  },
  points = { E = "tip" },
  forces = function(s) return { cart_y = s.inputs.push * rd.sin(s.t) } end,
  constraints = function(s)
    local E = s.points.E
    local height = rd.parameter("height", s.start.points.E.z, "m")
    return {
      rd.position { E.z - height - 0.05*rd.sin(s.t)^2, alpha = p.alpha, beta = p.beta },
      rd.velocity { E.xd - p.speed*rd.sin(s.t), alpha = p.alpha },
    }
  end,
}
