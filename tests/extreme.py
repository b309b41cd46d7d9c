"""What the tests of extreme numbers share: the limits of an answer, and two small models."""

SECONDS, MEGABYTES = 10, 1000

# A cart that a force moves, and one that a drive moves along a programme, with a mass on a spring.
CART = """local rd = require "refdyn"
local p = rd.parameters { { "m", 2, "kg" }, { "c", 50, "N/m" }, { "d", 3, "N s/m" }, { "T", 1, "s" } }
local push = rd.input("push", 1, "N")
return rd.model {
  name = "cart", gravity = { 0, 0, 0 },
  links = { { "a", joint = "x", mass = p.m, spring = { x = p.c }, damper = { x = p.d }, limits = { x = { force = 50 } } } },
  points = { E = { on = "a" } },
  forces = function(s) return { a_x = push } end,
}"""
DRIVEN = """local rd = require "refdyn"
local p = rd.parameters { { "m", 2, "kg" }, { "T", 1, "s" }, { "d", 1, "m" } }
return rd.model {
  name = "driven", gravity = { 0, 0, 0 },
  links = { { "a", joint = "x", mass = p.m, limits = { x = { force = 50 } } },
            { "b", on = "a", joint = "x", mass = 1, spring = { x = 400 }, damper = { x = 4 } } },
  points = { E = { on = "b" } },
  drives = { "a_x" },
  constraints = function(s) return { rd.position { s.points.E.x - p.d * rd.smoothstep(s.t, 0, p.T, 9) } } end,
}"""
