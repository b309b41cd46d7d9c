-- Closed linkages on a frame that three angles turn in space; `base` lets the frame yaw and pitch. All are overconstrained: a count of rows
-- leaves them fewer degrees of freedom than the one that each has.
local rd = require "refdyn"
local kind = rd.option("kind", "fourbar")      -- fourbar, slider, bennett, spherical, sarrus, parallelogram
local base = rd.option("base", "fixed")        -- fixed, moving
local unit = rd.option("unit", 1.0)              -- all lengths are multiplied by it
local off = rd.option("off", 0.0)                -- Bennett's linkage: error of one axis [rad]
local by = rd.option("by", "close")            -- close, ball, axes: rd.close or rows of axes; rows: the author's, multiplied by `factor`
local factor = rd.option("factor", 1.0)
local p = rd.parameters { { "a", 0, "rad" }, { "b", 0, "rad" }, { "c", 0, "rad" }, { "gx", 0, "m/s^2" }, { "gy", 0, "m/s^2" }, { "gz", -9.81, "m/s^2" } }
local sin, cos, atan, pi = math.sin, math.cos, math.atan, math.pi

local links = { { "frame", turn = { { "x", p.a }, { "y", p.b }, { "z", p.c } } } }
if base == "moving" then
  links = { { "base", joint = { "psi", "theta" }, mass = 20, center = { 0.1 * unit, 0.05 * unit, 0.02 * unit },
              inertia = { xx = 2 * unit^2, yy = 3 * unit^2, zz = 2.5 * unit^2 }, start = { psi = 0.3, theta = 0.2 }, start_rate = { psi = 0.5, theta = -0.4 } },
            { "frame", on = "base", turn = { { "x", p.a }, { "y", p.b }, { "z", p.c } } } }
end

local function bar(name, on, at, turn, length, mass, start, joint)
  local l = length * unit
  local J = mass * l^2 / 12
  links[#links + 1] = { name, on = on, at = at and { at[1] * unit, at[2] * unit, (at[3] or 0) * unit } or nil, turn = turn, joint = joint or "psi",
    mass = mass, center = { l / 2, 0.01 * unit, 0.02 * unit }, inertia = { xx = J / 5, yy = J, zz = J }, start = { [joint or "psi"] = start } }
end

local ends                                     -- two places that a hinge joins
local function ended(a, b) ends = { a, b } end
local function place(on, at, turn) return { on = on, at = { at[1] * unit, at[2] * unit, (at[3] or 0) * unit }, turn = turn } end

-- The angles of coupler and rocker of a four-bar a, b, c, d at the crank's angle.
local function fourbar(a, b, c, d, crank)
  local ax, ay = a * cos(crank), a * sin(crank)
  local dx, dy = d - ax, -ay
  local D = math.sqrt(dx^2 + dy^2)
  local x = (D^2 + b^2 - c^2) / (2 * D)
  local y = math.sqrt(b^2 - x^2)
  local bx, by = ax + (x * dx - y * dy) / D, ay + (x * dy + y * dx) / D
  return atan(by - ay, bx - ax) - crank, atan(by, bx - d)
end

local models = {}
function models.fourbar()
  local coupler, rocker = fourbar(0.4, 1.1, 0.8, 1, 0.5)
  bar("crank", "frame", nil, nil, 0.4, 1, 0.5)
  bar("coupler", "crank", { 0.4, 0 }, nil, 1.1, 2, coupler)
  bar("rocker", "frame", { 1, 0 }, nil, 0.8, 1.5, rocker)
  ended(place("rocker", { 0.8, 0 }), place("coupler", { 1.1, 0 }))
end
function models.slider()
  local crank = 0.7
  local rod = -math.asin(0.3 * sin(crank) / 0.8)
  bar("crank", "frame", nil, nil, 0.3, 1, crank)
  bar("rod", "crank", { 0.3, 0 }, nil, 0.8, 1.5, rod - crank)
  bar("block", "frame", nil, nil, 0.2, 2, (0.3 * cos(crank) + 0.8 * cos(rod)) * unit, "x")
  ended(place("block", { 0, 0 }), place("rod", { 0.8, 0 }))
end
function models.bennett()
  local a, al, be = 0.4, 0.7, 1.3
  local b = a * sin(be) / sin(al)
  local t1 = 1
  local t2 = 2 * atan(sin((be + al) / 2) / sin((be - al) / 2) / math.tan(t1 / 2))
  bar("l1", "frame", nil, nil, a, 1, t1)
  bar("l2", "l1", { a, 0 }, { { "x", al } }, b, 1, t2)
  bar("l3", "l2", { b, 0 }, { { "x", be } }, a, 1, 2 * pi - t1)
  ended(place("l3", { a, 0 }, { { "x", al + off } }), place("frame", { -b, 0 }, { { "x", -be } }))
end
-- All axes meet at the frame's origin; the arcs between them are like the bars of a four-bar.
function models.spherical()
  local crank, coupler, rocker, ground = 0.5, 1.1, 0.9, 1.2
  local t = 0.6
  local function axis(turns)              -- the third column of the product of turns about z and x
    local x, y, z = 0, 0, 1
    for i = #turns, 1, -1 do
      local by, angle = turns[i][1], turns[i][2]
      if by == "x" then y, z = cos(angle) * y - sin(angle) * z, sin(angle) * y + cos(angle) * z
      else x, y = cos(angle) * x - sin(angle) * y, sin(angle) * x + cos(angle) * y end
    end
    return x, y, z
  end
  local function miss(rock)               -- cosine of the arc between the moving axes
    local ax, ay, az = axis { { "z", t }, { "x", crank } }
    local bx, by, bz = axis { { "x", ground }, { "z", rock }, { "x", rocker } }
    return ax * bx + ay * by + az * bz - cos(coupler), bx, by, bz
  end
  local low, high = 0, pi
  for _ = 1, 200 do
    local middle = (low + high) / 2
    if (miss(low) > 0) == (miss(middle) > 0) then low = middle else high = middle end
  end
  local _, bx, by, bz = miss(low)
  -- the coupler's angle: in the crank's axes the far axis is (sin(coupler) sin(u), -sin(coupler) cos(u), cos(coupler))
  local x, y = cos(t) * bx + sin(t) * by, -sin(t) * bx + cos(t) * by
  local y2 = cos(crank) * y + sin(crank) * bz
  bar("crank", "frame", nil, nil, 0.4, 1, t)
  bar("coupler", "crank", nil, { { "x", crank } }, 0.5, 2, atan(x, -y2))
  bar("rocker", "frame", nil, { { "x", ground } }, 0.4, 1.5, low)
  ended(place("rocker", { 0, 0 }, { { "x", rocker } }), place("coupler", { 0, 0 }, { { "x", coupler } }))
end
-- Two pairs of plates with parallel hinges, in planes at right angles, guide a plate on a straight line.
function models.sarrus()
  local t, up = 0.6, { "x", pi / 2 }
  bar("left1", "frame", nil, { up }, 0.5, 1, t)
  bar("left2", "left1", { 0.5, 0 }, nil, 0.5, 1.2, pi - 2 * t)
  bar("plate", "left2", { 0.5, 0 }, nil, 0.3, 2, t - pi)
  bar("right1", "frame", { 0.2, 0.2 }, { up, { "y", pi / 2 } }, 0.5, 1, t)
  bar("right2", "right1", { 0.5, 0 }, nil, 0.5, 1.5, pi - 2 * t)
  ended(place("right2", { 0.5, 0 }), place("plate", { 0.2, 0, -0.2 }, { { "y", pi / 2 } }))
end
function models.parallelogram()
  local t = 0.6
  bar("left", "frame", nil, nil, 0.5, 1, t)
  bar("coupler", "left", { 0.5, 0 }, nil, 1, 2, -t)
  bar("right", "frame", { 1, 0 }, nil, 0.5, 1.5, t)
  ended(place("right", { 0.5, 0 }), place("coupler", { 1, 0 }))
end
assert(models[kind], "kind")()

local function rows(s)
  local e, f = ends[1], ends[2]
  if by == "ball" then return { rd.close { e, f, joint = "ball", name = "pin" } } end
  if by == "close" then return { rd.close { e, f, joint = "psi", name = "pin" } } end
  if by == "axes" then
    local function axis(at) return { on = at.on, at = at.at, turn = at.turn, direction = "z" } end
    return { rd.parallel { axis(e), axis(f) }, rd.on_line { e, axis(f) }, rd.on_plane { e, axis(f) } }
  end
  local A, B, list = s.points.first, s.points.second, {}
  for i, x in ipairs { "x", "y", "z" } do list[i] = rd.position { factor * (A[x] - B[x]), name = x } end
  for i, b in ipairs { B.axes.x, B.axes.y } do
    list[3 + i] = rd.position { factor * (A.axes.z.x * b.x + A.axes.z.y * b.y + A.axes.z.z * b.z), name = "turn" .. i }
  end
  return list
end

return rd.model { name = "turned", gravity = { p.gx, p.gy, p.gz }, links = links, points = { first = ends[1], second = ends[2] },
                  constraints = rows }
