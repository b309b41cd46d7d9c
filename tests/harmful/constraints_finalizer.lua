-- expect: 7: setmetatable: __gc is not allowed in a model
-- Tries a finalizer in constraints.
local rd = require "refdyn"

return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } },
  constraints = function(s)
    setmetatable({}, { __gc = function() while true do end end })
    return {}
  end }
