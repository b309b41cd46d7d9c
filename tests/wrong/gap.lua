-- expect: 6: item 2 of a list is nil; lists must have no gaps
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x", nil, "y" }, mass = 1 },
  },
}
