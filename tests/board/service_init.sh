#!/bin/bash
# Starts a systemd in namespaces of its own: it sees this machine's files, with empty folders over
# those that the unit and its installation write to. test_service.py sets the variables.
set -e
for folder in /run /opt /var/lib; do mount -t tmpfs none $folder; done
mkdir /run/etc /run/work /run/units
mount -t overlay none -o lowerdir=/etc,upperdir=/run/etc,workdir=/run/work /etc
getent group i2c || echo i2c:x:64000: >> /etc/group
mkdir /opt/python /opt/packages /opt/checkout
mount --bind "$BASE" /opt/python
mount --bind "$PACKAGES" /opt/packages
mount --bind "$CHECKOUT" /opt/checkout
cat > /run/edge-classify <<END
#!/bin/sh
export PYTHONPATH=/opt/checkout:/opt/packages PYTHONDONTWRITEBYTECODE=1
exec /opt/python/bin/$PYTHON -m edge "\$@"
END
install -D -m 755 -t /opt/edge-classify/bin /run/edge-classify
install -D -m 644 -t /etc/edge-classify "$FOLDER"/*
cp "$CHECKOUT/docs/examples/service/edge-classify.service" /run/units
for target in multi-user basic shutdown sysinit; do
  printf '[Unit]\nDefaultDependencies=no\n' > /run/units/$target.target
done
drop_in=/run/units/edge-classify.service.d
install -D -m 644 -t $drop_in "$CHECKOUT/docs/examples/service/real-time.conf"
printf '[Service]\nStandardOutput=append:/run/log\nStandardError=append:/run/log\n' > $drop_in/log.conf
export container=edge SYSTEMD_UNIT_PATH=/run/units PATH=/usr/sbin:/usr/bin:/sbin:/bin
exec $SYSTEMD --system --unit=multi-user.target --show-status=no --log-target=null
