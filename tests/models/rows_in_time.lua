-- Three links in a plane, point masses at their ends, angles from link to link. Row `level` keeps the last link's direction;
-- row `both` does the same and, while its weight is not 0, also keeps the angle of the second link.
-- `weight` of t: until T it jumps to 0, falls linearly, as a ramp of half a cosine, or as a cubic; `gone`: linearly, in a row with
-- no other term, so that the whole row vanishes; or the row comes at T and
-- holds the rate of that angle, by a velocity row: moving links are caught, as in an inelastic impact.
-- `step` of the position: a row that comes at T and requires another position than the motion has.
local rd = require "refdyn"
local weight = rd.option("weight", "jump", { "jump", "straight", "ramp", "cubic", "gone", "comes", "step" })
local T = rd.option("T", 0.37)

local function link(name, on, at, length, mass, psi, rate)
  return { name, on = on, at = at, joint = "psi", start = { psi = psi }, start_rate = { psi = rate }, mass = mass, center = { length, 0, 0 } }
end

return rd.model {
  name = "rows_in_time", gravity = { 0.6, -9.81, 0 },
  links = {
    link("a", nil, nil, 0.7, 1.3, 0.4, 0.9),
    link("b", "a", { 0.7, 0, 0 }, 0.5, 0.8, -0.7, weight == "comes" and 0.5 or 0),
    link("c", "b", { 0.5, 0, 0 }, 0.4, 0.6, 1.1, weight == "comes" and -1.4 or -0.9),
  },
  constraints = function(s)
    local a, b, c, t = s.q.a_psi, s.q.b_psi, s.q.c_psi, s.t
    local level = a + b + c - 0.8
    local first = rd.position { level, name = "level", alpha = 20, beta = 20 }
    if weight == "comes" then
      return { first, rd.velocity { rd.where(rd.less(t, T), 0, 1) * s.qd.b_psi, name = "both", alpha = 20 } }
    elseif weight == "step" then
      return { first, rd.position { 1.7 * level + rd.where(rd.less(t, T), 0, 1) * (b + 0.9), name = "both", alpha = 20, beta = 20 } }
    end
    if weight == "gone" then
      return { first, rd.position { rd.max(0, T - t) * (b + 0.7), name = "both", alpha = 20, beta = 20 } }
    end
    local w = weight == "jump" and rd.where(rd.less(t, T), 1, 0) or weight == "straight" and rd.max(0, T - t)
              or weight == "ramp" and 1 - rd.ramp(t, 0.1, T) or 1 - rd.smoothstep(t, 0, T)
    return { first, rd.position { 1.7 * level + w * (b + 0.7), name = "both", alpha = 20, beta = 20 } }
  end,
}
