-- A two-link arm in its vertical plane, whose tip follows a straight line: the way along it is a law by speeds at
-- knots of the path, by control points in time, or by knots in time. A plan varies these numbers.
local rd = require "refdyn"
local law = rd.option("law", "speeds", { "speeds", "control", "knots" })
local pieces = rd.option("pieces", 40)

local l1, l2 = 0.8, 0.6
local from, to = { 0.9, -0.5 }, { 0.4, 0.9 }

local list = { { "T", 2, "s" } }
local inner = law == "control" and pieces - 3 or pieces - 1
for i = 1, inner do
  local x = i / (inner + 1)
  list[#list + 1] = law == "speeds" and { "v" .. i, 0.8, "1/s" } or { "c" .. i, 10 * x^3 - 15 * x^4 + 6 * x^5 }
end
local p = rd.parameters(list)

-- The angles at the share c of the line, with the elbow bent backwards.
local function angles(c)
  local x, y = from[1] + c * (to[1] - from[1]), from[2] + c * (to[2] - from[2])
  local elbow = -rd.acos((x^2 + y^2 - l1^2 - l2^2) / (2 * l1 * l2))
  return rd.atan2(y, x) - rd.atan2(l2 * rd.sin(elbow), l1 + l2 * rd.cos(elbow)), elbow
end

local function share(t)
  local values = { 0 }
  for i = 1, inner do values[i + 1] = p[list[i + 1][1]] end
  if law == "speeds" then
    values[inner + 2] = 0
    return rd.timing { t, length = 1, speeds = values }
  end
  values[inner + 2] = 1
  if law == "knots" then
    local knots = {}
    for i, way in ipairs(values) do knots[i] = { i - 1, way } end
    return rd.timing { t, knots = knots, degree = 5, duration = p.T }
  end
  return rd.timing { t, control = values, duration = p.T }
end

local shoulder, elbow = angles(0)

return rd.model {
  name = "line_arm", gravity = { 0, -9.81, 0 },
  links = {
    { "upper", joint = "psi", mass = 5, center = { 0.4, 0, 0 }, inertia = { zz = 0.3 }, start = { psi = shoulder },
      limits = { psi = { rate = 2.5, force = 70 } } },
    { "fore", on = "upper", at = { l1, 0, 0 }, joint = "psi", mass = 3, center = { 0.3, 0, 0 }, inertia = { zz = 0.12 },
      start = { psi = elbow }, limits = { psi = { rate = 4, force = 25 } } },
    { "hand", on = "fore", at = { l2, 0, 0 } },
  },
  points = { hand = "hand" },
  constraints = function(s)
    local first, second = angles(share(s.t).way)
    return { rd.drive { "upper_psi", first, alpha = 0, beta = 0 }, rd.drive { "fore_psi", second, alpha = 0, beta = 0 } }
  end,
  courses = function(s) return { duration = share(s.t).duration } end,
  limits = function(s)
    if law == "speeds" then return {} end
    local first, second = angles(share(s.t).way)
    local function jerk(angle) return rd.rate(rd.rate(rd.rate(angle))) end
    return { { "upper_jerk", jerk(first), from = -200, to = 200 }, { "fore_jerk", jerk(second), from = -200, to = 200 } }
  end,
}
