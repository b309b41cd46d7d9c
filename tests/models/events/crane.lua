local rd = require "refdyn"
local p = rd.parameters { { "e", 0.4 }, { "rail", 7.3, "m" }}
return rd.model {
  name = "crane", gravity = { 0, 0, -9.81 },
  links = { { "cart", joint = "x", mass = 50, start = {x = 5} }, { "load", on = "cart", joint = "theta", mass = 20, center = {0,0,-3} } },
  forces = function(s) return { cart_x = 60 } end,
  events = function(s) return { rd.event { p.rail - s.q.cart_x, restitution = p.e, name = "buffer" } } end,
}
