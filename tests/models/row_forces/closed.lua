-- Closed mechanisms whose drives determine their motion, in a frame that is turned in space.
local rd = require "refdyn"
local scene = rd.option("scene", "four_bar")
local p = rd.parameters { { "tilt_x", 0, "rad" }, { "tilt_y", 0, "rad" }, { "tilt_z", 0, "rad" }, { "fast", 1, "1" } }
local size = rd.option("size", 1.0)
local g = 9.81

local function place(x, y) return { size * x, size * y, 0 } end

-- A bar of length L along its x axis, with a spring, a damper and a rotor in its hinge.
local function bar(name, on, at, L, m, start)
  return { name, on = on, at = at, joint = "psi", mass = m, center = place(L / 2, 0.03), inertia = { xx = m * (0.01 * size)^2, yy = m * (L * size)^2 / 12, zz = m * (L * size)^2 / 12 },
           start = { psi = start }, spring = { psi = 3 * m }, damper = { psi = 0.4 * m }, rotor = { psi = { inertia = 2e-3, gear = 5 } } }
end
local function frame()
  return { "frame", joint = {}, turn = { { "x", p.tilt_x }, { "y", p.tilt_y }, { "z", p.tilt_z } } }
end
local function course(s, from, size, rate)
  return from + size * rd.sin(rate * p.fast * s.t)
end

local scenes = {}

-- Crank a, coupler, rocker. `gear` drives the crank by a motor whose angle is -3 times its own.
local function four_bar(closing, gear)
  local a, b, c, d, t2 = 0.4, 1.1, 0.8, 1.0, 0.5
  local ax, ay = a * math.cos(t2), a * math.sin(t2)
  local D = math.sqrt((d - ax)^2 + ay^2)
  local x = (D * D + b * b - c * c) / (2 * D)
  local y = math.sqrt(b * b - x * x)
  local bx, by = ax + x * (d - ax) / D + y * ay / D, ay - x * ay / D + y * (d - ax) / D
  local t3, t4 = math.atan(by - ay, bx - ax), math.atan(by, bx - d)
  local links = { frame(), bar("crank", "frame", nil, a, 1, t2), bar("coupler", "crank", place(a, 0), b, 2, t3 - t2),
                  bar("rocker", "frame", place(d, 0), c, 1.5, t4) }
  if gear then links[5] = bar("motor", "frame", place(0, -1), 0.1, 0.2, -3 * t2) end
  return links, function(s)
    local rows = closing { { on = "rocker", at = place(c, 0) }, { on = "coupler", at = place(b, 0) } }
    if gear then
      return { rows, rd.position { s.q.motor_psi + 3 * s.q.crank_psi, name = "gear" }, rd.drive { "motor_psi", -3 * course(s, t2, 0.3, 2) } }
    end
    return { rows, rd.drive { "crank_psi", course(s, t2, 0.3, 2) } }
  end
end

function scenes.four_bar() return four_bar(function(e) return rd.close { e[1], e[2], joint = "ball", name = "pin" } end) end
function scenes.hinged() return four_bar(function(e) return rd.close { e[1], e[2], joint = "psi", name = "pin" } end) end
function scenes.geared() return four_bar(function(e) return rd.close { e[1], e[2], joint = "ball", name = "pin" } end, true) end
-- The distance of two points instead of a coupler.
function scenes.rod()
  return { frame(), bar("crank", "frame", nil, 0.4, 1, 0.5), bar("rocker", "frame", place(1, 0), 0.8, 1.5, 1.2) }, function(s)
    local far = size * math.sqrt((1 + 0.8 * math.cos(1.2) - 0.4 * math.cos(0.5))^2 + (0.8 * math.sin(1.2) - 0.4 * math.sin(0.5))^2)
    return { rd.distance { { on = "crank", at = place(0.4, 0) }, { on = "rocker", at = place(0.8, 0) }, far }, rd.drive { "crank_psi", course(s, 0.5, 0.3, 2) } }
  end
end
-- The piston slides along the frame's x axis.
function scenes.slider()
  local a, b, t2 = 0.3, 0.9, 0.7
  local t3 = -math.asin(a * math.sin(t2) / b)
  return { frame(), bar("crank", "frame", nil, a, 1, t2), bar("rod", "crank", place(a, 0), b, 2, t3 - t2),
           { "piston", on = "frame", joint = "x", mass = 1.3, start = { x = size * (a * math.cos(t2) + b * math.cos(t3)) }, damper = { x = 2 } } },
         function(s) return { rd.close { { on = "piston" }, { on = "rod", at = place(b, 0) }, joint = "ball", name = "pin" }, rd.drive { "crank_psi", course(s, t2, 0.5, 3) } } end
end
-- Two driven cranks, two couplers.
function scenes.five_bar()
  local l, r = 2.3, 0.9
  local ax, ay, bx, by = -0.15 + 0.35 * math.cos(l), 0.35 * math.sin(l), 0.15 + 0.35 * math.cos(r), 0.35 * math.sin(r)
  local D = math.sqrt((bx - ax)^2 + (by - ay)^2)
  local h = math.sqrt(0.25 - D * D / 4)
  local tx, ty = (ax + bx) / 2 - h * (by - ay) / D, (ay + by) / 2 + h * (bx - ax) / D
  local f, k = math.atan(ty - ay, tx - ax), math.atan(ty - by, tx - bx)
  return { frame(), bar("left", "frame", place(-0.15, 0), 0.35, 0.5, l), bar("fore", "left", place(0.35, 0), 0.5, 0.4, f - l),
           bar("right", "frame", place(0.15, 0), 0.35, 0.6, r), bar("lower", "right", place(0.35, 0), 0.5, 0.3, k - r) },
         function(s) return { rd.drive { "left_psi", course(s, l, 0.2, 2) }, rd.close { { on = "fore", at = place(0.5, 0) }, { on = "lower", at = place(0.5, 0) }, joint = "ball", name = "pin" },
                              rd.drive { "right_psi", course(s, r, -0.15, 3) } } end
end
-- Three parallel cranks: all rows of the two loops depend on each other, the drive does not.
function scenes.parallel()
  local links = { frame(), bar("a", "frame", nil, 0.4, 1, 0.7), bar("coupler", "a", place(0.4, 0), 1, 2, -0.7), bar("b", "frame", place(1, 0), 0.4, 1.5, 0.7),
                  bar("c", "frame", place(0.5, 0), 0.4, 1.2, 0.7) }
  return links, function(s)
    return { rd.loop { { on = "b", at = place(0.4, 0) }, { on = "coupler", at = place(1, 0) }, name = "pin" },
             rd.loop { { on = "c", at = place(0.4, 0) }, { on = "coupler", at = place(0.5, 0) } }, rd.drive { "a_psi", course(s, 0.7, 0.4, 2) } }
  end
end
-- The same, with a second drive that does the same as the first: their shares are not unique.
function scenes.twice()
  local links, rows = scenes.parallel()
  return links, function(s)
    local list = rows(s)
    list[#list + 1] = rd.drive { "b_psi", course(s, 0.7, 0.4, 2) }
    return list
  end
end

-- A parallelogram whose bars lie on one line at t = 0.5 s.
function scenes.fold()
  return { frame(), bar("a", "frame", nil, 0.4, 1, 0.5), bar("coupler", "a", place(0.4, 0), 1, 2, -0.5), bar("b", "frame", place(1, 0), 0.4, 1.5, 0.5) }, function(s)
    return { rd.loop { { on = "b", at = place(0.4, 0) }, { on = "coupler", at = place(1, 0) }, keep = "x, y", name = "pin" }, rd.drive { "a_psi", 0.5 - p.fast * s.t } }
  end
end

local links, rows = scenes[scene]()
return rd.model { name = "closed", gravity = place(0, -g), links = links, constraints = rows,
                  limits = scene == "twice" and function() return { { "torque", column = "force_a_psi", to = 1e3 } } end or nil }
