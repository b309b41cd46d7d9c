-- A mass that a relay with hysteresis pushes back and forth.
local rd = require "refdyn"
local p = rd.parameters { { "b", 0.3, "m" }, { "F", 2, "N" }, { "v", 0.7, "m/s" } }
local push = rd.input("push", 1, "N")
return rd.model {
  name = "relay",
  links = { { "cart", joint = "x", mass = 1, start_rate = { x = p.v } } },
  forces = function(s) return { cart_x = p.F * push } end,
  events = function(s)
    return {
      rd.event { s.q.cart_x - p.b, direction = "up", inputs = { push = -1 }, name = "off" },
      rd.event { s.q.cart_x + p.b, direction = "down", inputs = { push = 1 }, name = "on" },
    }
  end,
}
