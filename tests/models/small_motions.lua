-- Systems whose small motions have closed forms; the option `kind` selects one.
local rd = require "refdyn"
local kind = rd.option("kind", "double", { "double", "rods", "oscillator", "upright", "skate", "lag", "curved", "gear", "pair" })
local p = rd.parameters { { "c", 0.6, "N s/m" }, { "a", 1.5, "1/s" } }
local gravity = { 0, 0, -9.81 }

local function distance(a, b) return rd.distance { a, b, 0.5, alpha = 20, beta = 30 } end
local function velocity(expression) return rd.velocity { expression, alpha = 20 } end

local kinds = {
  -- Two equal point pendulums, one below the other: omega^2 = g / l (2 -+ sqrt(2)).
  double = {
    links = { { "upper", joint = "theta", mass = 0.7, center = { 0, 0, -0.5 } },
              { "lower", on = "upper", at = { 0, 0, -0.5 }, joint = "theta", mass = 0.7, center = { 0, 0, -0.5 } } },
    points = { E = { on = "lower", at = { 0, 0, -0.5 } } },
  },
  -- The same as two masses on slides, kept in place by massless rods.
  rods = {
    links = { { "upper", joint = "x, z", start = { z = -0.5 }, mass = 0.7 },
              { "lower", joint = "x, z", start = { z = -1 }, mass = 0.7 } },
    points = { O = "ground", D = "upper", E = "lower" },
    constraints = function() return { distance("O", "D"), distance("D", "E") } end,
  },
  -- 2 xdd + c xd + 18 x = 0.
  oscillator = { links = { { "cart", joint = "x", mass = 2, spring = { x = 18 }, damper = { x = p.c } } } },
  -- A point pendulum, 0.5 m long, in the inverted position.
  upright = { links = { { "rod", joint = "theta", mass = 0.7, center = { 0, 0, 0.5 } } } },
  -- A blade across a slope: its row bears 2 kg down the slope (-z), and the direction of its force turns with the blade:
  -- unsymmetric, 2 xdd + 8 x - 2 g theta = 0, 0.1 thetadd + 5 theta = 0.
  skate = {
    links = { { "sledge", joint = "x, z", mass = 1, spring = { x = 8 } },
              { "blade", on = "sledge", joint = "theta", mass = 1, inertia = { yy = 0.1 }, spring = { theta = 5 } } },
    constraints = function(s)
      return { velocity(s.qd.sledge_x * rd.sin(s.q.blade_theta) + s.qd.sledge_z * rd.cos(s.q.blade_theta)) }
    end,
  },
  -- A velocity row with restoring effect, xd = -a x for any mass, and a load on a spring there.
  lag = {
    links = { { "lead", joint = "x", mass = 2 }, { "load", on = "lead", joint = "x", mass = 1, spring = { x = 9 } } },
    constraints = function(s) return { velocity(s.qd.lead_x + p.a * s.q.lead_x) } end,
  },
  -- A row that is nonlinear in the rates and bears 3 N: ydd + 2 0.1 3 yd + 4 y = 0. The slide z is held under 5 N.
  curved = {
    links = { { "first", joint = "x", mass = 1 }, { "second", joint = "y", mass = 1, spring = { y = 4 } },
              { "third", joint = "z", mass = 1 } },
    gravity = { 0, 0, 0 },
    forces = function() return { first_x = 3, third_z = 5 } end,
    constraints = function(s) return { velocity(s.qd.first_x + s.qd.third_z + 0.1 * s.qd.second_y^2) } end,
    hold = "third_z",
  },
  -- A gear whose ratio changes with time, (2 + t) x + y = 0: at t, (1 + ratio^2) xdd + (5 + 3 ratio^2) x = 0.
  gear = {
    links = { { "first", joint = "x", mass = 1, spring = { x = 5 } }, { "second", joint = "y", mass = 1, spring = { y = 3 } } },
    gravity = { 0, 0, 0 },
    constraints = function(s)
      return { rd.position { (2 + s.t) * s.q.first_x + s.q.second_y, alpha = 20, beta = 30 } }
    end,
  },
  -- Two carts between springs, one with a damper: their phases differ.
  pair = {
    links = { { "left", joint = "x", mass = 1, spring = { x = 20 }, damper = { x = 2 } },
              { "right", joint = "x", mass = 1.5, spring = { x = 20 } } },
    points = { L = "left", R = "right" },
    forces = function() return { rd.spring { "L", { on = "right", at = { 0.5, 0, 0 } }, stiffness = 15 } } end,
  },
}

local model = kinds[kind]
model.name, model.gravity = "small_motions", model.gravity or gravity
return rd.model(model)
