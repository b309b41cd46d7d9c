-- A pendulum that hits a wall: as a turn, or as a point that a row keeps on a circle.
local rd = require "refdyn"
local form = rd.option("form", "turn", { "turn", "row" })
local set = rd.option("set", "restitution", { "restitution", "rates" })
local p = rd.parameters { { "e", 0.7 }, { "wall", -0.2, "m" }, { "k", 0.5 } }
local links = form == "turn" and { { "rod", turn = { { "x", rd.pi / 2 } }, joint = { "psi" }, start = { psi = 0.1 } }, { "bob", on = "rod", at = { 1, 0, 0 }, mass = 2 } }
  or { { "bob", joint = { "x", "z" }, mass = 2, start = { x = rd.cos(0.1), z = rd.sin(0.1) } } }
return rd.model {
  name = "pendulum", gravity = { 0, 0, -9.81 }, links = links, points = { B = "bob" },
  constraints = function(s)
    local B = s.points.B
    return form == "row" and { rd.position { B.x ^ 2 + B.z ^ 2 - 1, alpha = 20, beta = 20 } } or {}
  end,
  events = function(s)
    local gap = s.points.B.x - p.wall
    if set == "restitution" then return { rd.event { gap, restitution = p.e, name = "wall" } } end
    return { rd.event { gap, direction = "down", rates = { bob_x = -p.k * s.qd.bob_x, bob_z = s.qd.bob_z }, name = "wall" } }
  end,
}
