-- expect: 5: setmetatable: __call is of type table; must be a function
-- Tries a chain of 100,000 tables that call each other.
local rd = require "refdyn"
local f = function() end
for i = 1, 1e5 do f = setmetatable({}, { __call = f }) end
f()
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
