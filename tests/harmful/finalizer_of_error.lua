-- expect: 5: setmetatable: __gc is not allowed in a model
-- Tries to run a finalizer when an error ends the model.
local rd = require "refdyn"
local events = { __gc = false }
setmetatable({}, events)
error("done")
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
