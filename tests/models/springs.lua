-- Two carts on slides, geared one to two; the first has a spring with a rest length and a damper. With x of the
-- first: (1.5 + 2^2 0.5) xd' = -40 (x - 0.2) - 7 xd + 1.5 g, a damped oscillation from x = 0.5 at 0.3 m/s.
local rd = require "refdyn"

return rd.model {
  name = "springs", gravity = { 9.81, 0, 0 },
  links = {
    { "cart", joint = "x", start = { x = 0.5 }, start_rate = { x = 0.3 }, spring = { x = 40 }, rest = { x = 0.2 },
      damper = { x = 7 }, mass = 1.5 },
    { "geared", joint = "y", start = { y = 1 }, start_rate = { y = 0.6 }, mass = 0.5 },
  },
  constraints = function(s) return { rd.position { s.q.geared_y - 2 * s.q.cart_x, alpha = 10, beta = 10 } } end,
}
