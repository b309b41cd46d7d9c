-- expect: 10: arithmetic on an expression and nil; must be a number or an expression
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = 1 },
  },
  forces = function(s)
    local c
    return { a_x = s.t * c }
  end,
}
