-- A ball that bounces on a table at rest or moving up and down; the option `balls` adds others.
local rd = require "refdyn"
local balls = rd.option("balls", 1, { from = 1, to = 9 })
local act = rd.option("act", "bounce", { "bounce", "record", "up", "both", "ends" })
local p = rd.parameters { { "e", 0.8 }, { "h", 1, "m" }, { "apart", 0, "m" }, { "v", 0, "m/s" }, { "A", 0, "m" }, { "w", 20, "rad/s" } }
local links = {}
for i = 1, balls do
  links[i] = { "ball" .. i, joint = "x, z", mass = i, start = { z = p.h + (i - 1) * p.apart }, start_rate = { x = 1, z = p.v } }
end
return rd.model {
  name = "ball", gravity = { 0, 0, -9.81 }, links = links,
  events = function(s)
    local list = {}
    for i = 1, balls do
      local gap = s.q["ball" .. i .. "_z"] - p.A * rd.sin(p.w * s.t)
      if act == "bounce" then
        list[i] = rd.event { gap, restitution = p.e, name = "impact " .. i }
      elseif act == "record" then
        list[i] = rd.event { gap, direction = "down" }
      else
        list[i] = rd.event { gap, direction = act == "ends" and "down" or act, ends = act == "ends", name = "level " .. i }
      end
    end
    return list
  end,
}
