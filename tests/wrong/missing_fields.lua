-- expect: 4: name: missing; the model needs it
-- expect: 6: links[1].name: missing; a link needs it
local rd = require "refdyn"
return rd.model {
  links = {
    { joint = { "x" }, mass = 1 },
  },
}
