-- The car axis of the test set for initial value problems (Mazzia and Magherini 2008): two point masses, a rod of
-- length L between them; springs of rest length L0 connect the left one to the origin, the right one to a wheel that moves
-- up and down; the left one stays on the line through the origin at right angles to the direction of the wheel.
local rd = require "refdyn"
local p  = rd.parameters {
  { "M", 10, "kg" }, { "L", 1, "m" }, { "L0", 0.5, "m" }, { "r", 0.1, "m" }, { "omega", 10, "rad/s" },
  { "g", 1, "m/s^2" }, { "k", 1e4, "N/m" }, { "alpha", 100, "1/s" }, { "beta", 100, "1/s" },
}

local height = function(t) return p.r * rd.sin(p.omega * t) end

return rd.model {
  name = "car_axis", gravity = { 0, -p.g, 0 },
  links = {
    { "left", joint = { "x", "y" }, mass = p.M / 2, start = { y = 0.5 }, start_rate = { x = -0.5 } },
    { "right", joint = { "x", "y" }, mass = p.M / 2, start = { x = 1, y = 0.5 }, start_rate = { x = -0.5 } },
    { "wheel", joint = { "x", "y" }, mass = 1, start = { x = 1 }, start_rate = { y = 1 } },       -- any mass: prescribed motion
  },
  forces = function()
    return {
      rd.spring { "left", "ground", stiffness = p.k, rest = p.L0 },
      rd.spring { "right", "wheel", stiffness = p.k, rest = p.L0 },
    }
  end,
  constraints = function(s)
    local q, y = s.q, height(s.t)
    return {
      rd.drive { "wheel_x", rd.sqrt(p.L^2 - y^2), alpha = p.alpha, beta = p.beta },
      rd.drive { "wheel_y", y, alpha = p.alpha, beta = p.beta },
      rd.position { q.wheel_x * q.left_x + q.wheel_y * q.left_y, alpha = p.alpha, beta = p.beta, name = "line" },
      rd.distance { "left", "right", p.L, alpha = p.alpha, beta = p.beta, name = "rod" },
    }
  end,
}
