-- The planar pendulum of the IFToMM benchmarks (A01): a point mass on two slides; a programme keeps it on a circle.
local rd = require "refdyn"

return rd.model {
  name = "pendulum_point", gravity = { 0, -9.81, 0 },
  links = { { "bob", joint = { "x", "y" }, mass = 1, start = { x = -1 } } },
  points = { E = "bob" },
  constraints = function(s)
    local E = s.points.E
    return { rd.position { E.x^2 + E.y^2 - 1, alpha = 20, beta = 20, name = "circle" } }
  end,
}
