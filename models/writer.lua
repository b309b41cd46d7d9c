-- An arm that writes: four axes move an upright pen along the strokes of letters, and in arches between the strokes.
-- Lengths are from the Mitsubishi Movemaster RV-M1 without its roll axis; masses, pen and letters are our own.
-- Checked: the pen reaches both ends of each stroke, and the joint angles satisfy the law of cosines.
local rd = require "refdyn"
local p  = rd.parameters { { "speed", 0.15, "m/s" }, { "g", 9.81, "m/s^2" } }
local height, upper, fore, hand = 0.3, 0.25, 0.16, 0.172                -- of the shoulder; lengths, including the pen

-- The letters "Rd": smooth curves through points of the sheet, to be read from the other side of the table.
local function at(right, up) return { 0.3 - 0.1 * up, 0.1 * right - 0.065, 0 } end
local strokes = {
  { at(0, 1), at(0, 0) },
  { at(0, 1), at(0.35, 0.97), at(0.52, 0.75), at(0.35, 0.53), at(0, 0.5) },
  { at(0.25, 0.5), at(0.55, 0) },
  { at(1.3, 0.45), at(1.05, 0.6), at(0.82, 0.3), at(1.05, 0), at(1.3, 0.15) },
  { at(1.3, 1), at(1.3, 0) },
}

-- Prescribed position of the pen: a path contributes nothing before its time, and its whole displacement after it.
local function pen(t)
  local place, time, last = at(0, 1), 0, nil
  local function follow(points)
    local path = rd.path(points)
    local way  = path.length * rd.smoothstep(t, time, time + path.length / p.speed)
    for i, axis in ipairs { "x", "y", "z" } do place[i] = place[i] + path[axis](way) - points[1][i] end
    time, last = time + path.length / p.speed, points[#points]
  end
  for _, stroke in ipairs(strokes) do
    local to = stroke[1]
    if last then follow { last, { (last[1] + to[1]) / 2, (last[2] + to[2]) / 2, 0.03 }, to } end
    follow(stroke)
  end
  return place
end

-- Start angles by the law of cosines between the shoulder and the wrist, which is above the pen.
local x, y = at(0, 1)[1], at(0, 1)[2]
local r, h = rd.sqrt(x^2 + y^2), hand - height
local bend = rd.acos((r^2 + h^2 - upper^2 - fore^2) / (2 * upper * fore))
local tilt = -rd.atan2(h, r) - rd.atan2(fore * rd.sin(bend), upper + fore * rd.cos(bend))
local function link(name, on, along, angle, length)
  local rod = rd.cylinder { diameter = 0.02, length = length, density = 2700, at = { length / 2, 0, 0 } }
  return { name, on = on, at = { along, 0, 0 }, joint = "theta", start = { theta = angle }, bodies = { rod } }
end

return rd.model {
  name = "writer", gravity = { 0, 0, -p.g },
  links = {
    { "waist", at = { 0, 0, height }, joint = "psi", start = { psi = rd.atan2(y, x) },
      bodies = { rd.cylinder { diameter = 0.08, length = height, axis = "z", mass = 4, at = { 0, 0, -height / 2 } } } },
    link("upper", "waist", 0, tilt, upper), link("fore", "upper", upper, bend, fore),
    link("hand", "fore", fore, rd.pi / 2 - tilt - bend, hand),
  },
  points = { pen = { on = "hand", at = { hand, 0, 0 } } },
  constraints = function(s)
    local E, q, place = s.points.pen, s.q, pen(s.t)
    return { rd.position { E.x - place[1] }, rd.position { E.y - place[2] }, rd.position { E.z - place[3] },
             rd.position { q.upper_theta + q.fore_theta + q.hand_theta - rd.pi / 2, name = "upright" } }
  end,
}
