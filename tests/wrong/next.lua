-- expect: 3: attempt to call a nil value (global 'next')
local rd = require "refdyn"
next(error)
