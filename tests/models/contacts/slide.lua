local rd = require "refdyn"
local p = rd.parameters { { "e", 0.2 } }
return rd.model {
  name = "slide",
  links = { { "cart", joint = "x", mass = 2, start = { x = 0.5 } } },
  forces = function(s) return { cart_x = -5 * rd.cos(s.t) } end,
  constraints = function(s) return { rd.contact { s.q.cart_x, restitution = p.e, name = "buffer" } } end,
}
