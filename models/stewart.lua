-- A Stewart platform (D. Stewart, "A platform with six degrees of freedom", Proceedings of the Institution of
-- Mechanical Engineers 180, 1965). The driven lengths of its six legs make it heave, roll and turn. A leg is a distance, or
-- a cylinder on a universal joint with a sliding rod that ends in a ball joint. Dimensions are our own. Checked: the
-- platform follows the programme, and the forces of its legs satisfy the balance of forces.
local rd = require "refdyn"
local legs = rd.option("legs", "light", { "light", "heavy" })           -- heavy: with mass, 24 coordinates, not 6
local p  = rd.parameters {
  { "height", 1, "m" }, { "heave", 0.1, "m" }, { "roll", 0.15, "rad" }, { "turn", 0.2, "rad" }, { "rate", 3, "rad/s" },
  { "T", 1, "s" }, { "m_platform", 80, "kg" }, { "m_cylinder", 6, "kg" }, { "m_rod", 3, "kg" }, { "g", 9.81, "m/s^2" },
}

-- The feet are in pairs on a circle of radius 0.8 m, the upper ends in pairs between them on a circle of radius 0.5 m.
local function on_circle(radius, angle) return { radius * rd.cos(angle), radius * rd.sin(angle), 0 } end
local feet, ends = {}, {}
for i = 1, 6 do
  local middle, side = 2 * rd.pi / 3 * ((i - 1) // 2), 2 * (i % 2) - 1
  feet[i], ends[i] = on_circle(0.8, middle - 0.2 * side), on_circle(0.5, middle - 0.85 * side)
end

-- Length of leg i and its three components, from foot to end, for a platform at a height, rolled about x and turned about z.
local function leg(i, height, roll, turn)
  local side = ends[i][1] * rd.sin(turn) + ends[i][2] * rd.cos(turn)    -- before the roll
  local x    = ends[i][1] * rd.cos(turn) - ends[i][2] * rd.sin(turn) - feet[i][1]
  local y, z = side * rd.cos(roll) - feet[i][2], height + side * rd.sin(roll)
  return rd.sqrt(x^2 + y^2 + z^2), x, y, z
end

-- The programme begins at rest.
local function length_at(t, i)
  local w, angle = rd.smoothstep(t, 0, p.T), p.rate * t
  return (leg(i, p.height + p.heave * w * rd.sin(angle), p.roll * w * rd.cos(angle), p.turn * w * rd.sin(2 * angle)))
end

local deck  = rd.cylinder { diameter = 1, length = 0.06, axis = "z", mass = p.m_platform }
local links = { { "platform", joint = "free", start = { z = p.height }, bodies = { deck } } }
for i = 1, legs == "heavy" and 6 or 0 do
  local length, x, y, z = leg(i, p.height, 0, 0)
  local cylinder = rd.cylinder { diameter = 0.06, length = 0.6, axis = "z", mass = p.m_cylinder, at = { 0, 0, 0.3 } }
  local rod      = rd.cylinder { diameter = 0.035, length = 0.6, axis = "z", mass = p.m_rod, at = { 0, 0, -0.3 } }
  table.insert(links, { "cylinder" .. i, at = feet[i], joint = "phi, theta", bodies = { cylinder },
                        start = { phi = rd.atan2(-y, z), theta = rd.asin(x / length) } })
  table.insert(links, { "rod" .. i, on = "cylinder" .. i, joint = "z", start = { z = length }, bodies = { rod } })
end

return rd.model {
  name = "stewart", gravity = { 0, 0, -p.g },
  links = links,
  points = { deck = { on = "platform", at = { 0.5, 0, 0 } } },
  constraints = function(s)
    local rows = {}
    for i = 1, 6 do
      local top, length, rod = { on = "platform", at = ends[i] }, length_at(s.t, i), "rod" .. i
      rows[i] = legs == "light" and rd.distance { { on = "ground", at = feet[i] }, top, length, name = "leg " .. i }
                or { rd.loop { rod, top, name = "ball " .. i }, rd.drive { rod .. "_z", length, name = "leg " .. i } }
    end
    return rows
  end,
}
