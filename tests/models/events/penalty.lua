-- A ball that bounces on a spring, with a kink at contact, written in three ways.
local rd = require "refdyn"
local form = rd.option("form", "max", { "max", "where", "energy" })
local p = rd.parameters { { "s", 1e5, "N/m" } }
return rd.model {
  name = "penalty", gravity = { 0, 0, -9.81 },
  links = { { "ball", joint = "z", mass = 1, start = { z = 1 } } },
  forces = function(s)
    local z = s.q.ball_z
    if form == "energy" then return { rd.energy { p.s / 2 * rd.max(-z, 0) ^ 2 } } end
    return { ball_z = form == "max" and p.s * rd.max(-z, 0) or rd.where(rd.less(z, 0), -p.s * z, 0) }
  end,
  events = function(s) return { rd.event { s.qd.ball_z, direction = "down", name = "top" } } end,
}
