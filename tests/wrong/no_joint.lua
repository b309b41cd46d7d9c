-- expect: 3: links: no link has a joint; a model needs at least one coordinate
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", mass = 1 },
  },
}
