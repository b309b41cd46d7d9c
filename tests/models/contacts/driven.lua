local rd = require "refdyn"
return rd.model {
  name = "driven",
  links = { { "cart", joint = "x", mass = 2, start = { x = 0.5 } } },
  constraints = function(s) return { rd.drive { "cart_x", 0.5 - 0.3 * s.t }, rd.contact { s.q.cart_x, restitution = 0.5, name = "buffer" } } end,
}
